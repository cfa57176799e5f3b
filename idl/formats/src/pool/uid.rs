//! The format of a rule UID, and the rules that a checker checks.

use std::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Text;

/// The rules that a checker checks, as listed in its catalogue. Every result contains all of them,
/// so they are shared and validated only once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Arc<[Text]>", into = "Arc<[Text]>")]
pub struct RuleUids {
    given: Arc<[Text]>,
    sound: bool,
}

impl RuleUids {
    /// Checks whether they can be written unchanged: each is a rule UID, and none is duplicated.
    pub(super) fn can_be_written(&self) -> bool {
        self.sound
    }

    /// Returns the shared rules.
    pub(super) fn shared(&self) -> &Arc<[Text]> {
        &self.given
    }
}

impl Default for RuleUids {
    fn default() -> RuleUids {
        RuleUids::from(Arc::default())
    }
}

impl From<Arc<[Text]>> for RuleUids {
    fn from(given: Arc<[Text]>) -> RuleUids {
        let mut sorted: Vec<&str> = given.iter().map(|uid| &**uid).collect();
        sorted.sort_unstable();
        let no_two = sorted.windows(2).all(|two| two[0] != two[1]);
        RuleUids {
            sound: no_two && sorted.iter().all(|uid| is_rule_uid(uid)),
            given,
        }
    }
}

impl From<RuleUids> for Arc<[Text]> {
    fn from(uids: RuleUids) -> Arc<[Text]> {
        uids.given
    }
}

impl<T: Into<Text>> FromIterator<T> for RuleUids {
    fn from_iter<I: IntoIterator<Item = T>>(uids: I) -> RuleUids {
        let given: Arc<[Text]> = uids.into_iter().map(Into::into).collect();
        RuleUids::from(given)
    }
}

impl Deref for RuleUids {
    type Target = [Text];

    fn deref(&self) -> &[Text] {
        &self.given
    }
}

/// Checks whether the text is a rule UID that ASAM's readers accept:
/// `entity.tld:standard:1.2.3:set.of.rules.name`.
pub fn is_rule_uid(text: &str) -> bool {
    if text.is_ascii() {
        is_ascii_rule_uid(text.as_bytes())
    } else {
        is_any_rule_uid(text)
    }
}

/// Checks ASCII rule UIDs byte by byte, which is fast. It runs hundreds of times for every file.
fn is_ascii_rule_uid(text: &[u8]) -> bool {
    // The current part of four, its number of words so far, and the length of the current word.
    let (mut part, mut words, mut length) = (0, 0, 0);
    for &byte in text {
        match (byte, part) {
            (b':', _) => {
                let enough = length > 0 && (part == 1 || words >= 1);
                if !enough || part == 3 {
                    return false;
                }
                (part, words, length) = (part + 1, 0, 0);
                continue;
            }
            (b'.', 0 | 2 | 3) if length > 0 => {
                (words, length) = (words + 1, 0);
                continue;
            }
            (b'a'..=b'z', 1) | (b'0'..=b'9', 2) => {}
            (b'a'..=b'z' | b'A'..=b'Z', 0 | 3) => {}
            (b'0'..=b'9' | b'_', 0) => {}
            (b'0'..=b'9' | b'_', 3) if length > 0 => {}
            _ => return false,
        }
        length += 1;
    }
    part == 3 && length > 0
}

fn is_any_rule_uid(text: &str) -> bool {
    let mut parts = text.split(':');
    let parts = [
        parts.next(),
        parts.next(),
        parts.next(),
        parts.next(),
        parts.next(),
    ];
    let [
        Some(entity),
        Some(standard),
        Some(setting),
        Some(name),
        None,
    ] = parts
    else {
        return false;
    };
    words(entity, is_word) >= 2
        && !standard.is_empty()
        && standard.bytes().all(|byte| byte.is_ascii_lowercase())
        && words(setting, |word| {
            word.bytes().all(|byte| byte.is_ascii_digit())
        }) >= 2
        && words(name, |word| {
            is_word(word) && word.starts_with(char::is_alphabetic)
        }) >= 1
}

/// Counts the words between dots; returns 0 when one is empty or invalid.
fn words(text: &str, good: impl Fn(&str) -> bool) -> usize {
    let mut count = 0;
    for word in text.split('.') {
        if word.is_empty() || !good(word) {
            return 0;
        }
        count += 1;
    }
    count
}

fn is_word(word: &str) -> bool {
    word.chars().all(|c| c.is_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::{is_any_rule_uid, is_rule_uid};

    #[test]
    fn rule_uid_follows_published_pattern() {
        for good in [
            "asam.net:xodr:1.7.0:road.lane.level_true_one_side",
            "qcbus.dev:qcbus:1.0.0:pooling.filtered",
            "asam.net:xosc:1.0:name",
            "a.b:c:1.0:camelCase.Names2",
        ] {
            assert!(is_rule_uid(good), "{good}");
        }
        for bad in [
            "",
            "asam.net:xodr:1.7.0",
            "asam:xodr:1.7.0:x",
            "asam.net:Xodr:1.7.0:x",
            "asam.net:xodr:1:x",
            "asam.net:xodr:1.7.0:1x",
            "asam.net:xodr:1.7.0:x.",
            "asam.net:xodr:1.7.0:x y",
            "asam.net:xodr:1.7.0:x:y",
            "asam.net:x1:1.7.0:x",
        ] {
            assert!(!is_rule_uid(bad), "{bad}");
        }
    }

    #[test]
    fn fast_uid_check_agrees_with_full_check() {
        let uid = "a9_.Bc.d:xo:1.70:rd.l_9.X";
        for at in 0..=uid.len() {
            for put in [":", ".", "", "a", "Z", "_", "7", " ", "::", "..", "é", "-"] {
                for cut in [0, 1] {
                    let end = (at + cut).min(uid.len());
                    let text = format!("{}{put}{}", &uid[..at], &uid[end..]);
                    assert_eq!(is_rule_uid(&text), is_any_rule_uid(&text), "{text}");
                    let start = &uid[..at];
                    assert_eq!(is_rule_uid(start), is_any_rule_uid(start), "{start}");
                }
            }
        }
    }
}
