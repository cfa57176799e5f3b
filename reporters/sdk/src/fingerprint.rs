//! Fingerprints: identify a finding again after its file was edited.
//!
//! Hosts keep a history of findings, for example new and dismissed ones. They need a name that
//! survives an edit elsewhere in the file and a new version of qcbus. The fingerprint contains only
//! identifiers of the cause: the rule, the file and the element.
//!
//! * Lines, columns and positions are not part of it, because they change with every edit above.
//! * In the element's XPath, predicates that only count (`road[2]`) are left out, because another
//!   road before it would change them. Predicates with a name (`road[@id='5']`) stay. If a finding
//!   has a place on a road, the road's id is a name too.
//! * The message is not part of it if there is an element. It contains measured numbers, and a
//!   better wording must not reopen dismissed findings. Without an element only the message is
//!   available; its numbers are left out.
//! * A place in another file uses only that file's name, because the directory differs between
//!   machines.
//!
//! Findings that are equal in all of this share a fingerprint. [`Repeats`] distinguishes them.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Issue;
use qcbus_messages::path_text::name_of;
use sha2::{Digest as _, Sha256};

use crate::IssueLocation;

/// Number of digest bytes used: two findings of a farm collide by chance once in 2^64 farms.
const KEPT: usize = 16;

/// Returns the fingerprint of a finding in lower-case hexadecimal digits. `file` is the display
/// path, `rule` the report's name of the rule, `place` the finding's main place.
pub fn fingerprint(file: &str, rule: &str, issue: &Issue, place: Option<&IssueLocation>) -> String {
    let element = place.and_then(|place| place.xpath.as_deref());
    let road = place.and_then(|place| place.road.as_ref());
    let other_file = place.and_then(|place| place.path.as_deref());
    let what = match element {
        Some(xpath) => by_names(xpath),
        None => without_numbers(&issue.description),
    };
    let kind = if element.is_some() { "element" } else { "text" };
    digest(&[
        rule,
        file,
        other_file.map_or("", name_of),
        road.map_or("", |(id, ..)| id),
        kind,
        &what,
    ])
}

/// Returns the fingerprint of something other than a finding, such as a checker without an answer.
pub fn fingerprint_of(parts: &[&str]) -> String {
    digest(parts)
}

/// Number of occurrences of each fingerprint.
#[derive(Debug, Default)]
pub struct Repeats(BTreeMap<String, u32>);

impl Repeats {
    /// Counts an occurrence of this fingerprint and returns the count: 1 for the first time.
    pub fn number(&mut self, fingerprint: &str) -> u32 {
        let number = self.0.entry(fingerprint.to_owned()).or_default();
        *number = number.saturating_add(1);
        *number
    }
}

fn digest(parts: &[&str]) -> String {
    let mut hasher = Sha256::new();
    for part in parts {
        // The lengths are included, so two different lists of parts never give the same text.
        hasher.update((part.len() as u64).to_le_bytes());
        hasher.update(part);
    }
    let bytes = hasher.finalize();
    bytes
        .iter()
        .take(KEPT)
        .map(|b| format!("{b:02x}"))
        .collect()
}

/// Returns the XPath without predicates that only count.
fn by_names(xpath: &str) -> String {
    let mut kept = String::with_capacity(xpath.len());
    let mut rest = xpath;
    while let Some(start) = rest.find('[') {
        let (before, predicate) = rest.split_at(start);
        let (predicate, after) = predicate.split_at(end_of_predicate(predicate));
        kept.push_str(before);
        if !counts(predicate) {
            kept.push_str(predicate);
        }
        rest = after;
    }
    kept.push_str(rest);
    kept
}

/// Returns the length of the predicate at the start of the text; quoted brackets do not end it.
fn end_of_predicate(text: &str) -> usize {
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if c == ']' => return at + 1,
            None if c == '\'' || c == '"' => quote = Some(c),
            None => {}
        }
    }
    text.len()
}

fn counts(predicate: &str) -> bool {
    let inside = predicate.trim_start_matches('[').trim_end_matches(']');
    inside.bytes().all(|byte| byte.is_ascii_digit())
}

fn without_numbers(text: &str) -> String {
    let is_part = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    let words = text.split_whitespace().map(|word| {
        let letters: String = word.chars().filter(|c| !is_part(*c)).collect();
        letters
    });
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use qcbus_formats::xqar::Level;

    use super::*;

    fn issue(description: &str) -> Issue {
        Issue {
            id: 0,
            description: description.into(),
            level: Level::Error,
            rule_uid: String::new(),
            locations: Vec::new(),
            domain_info: Vec::new(),
        }
    }

    fn place(row: u64, xpath: &str) -> IssueLocation {
        IssueLocation {
            row: Some(row),
            xpath: Some(xpath.into()),
            ..IssueLocation::default()
        }
    }

    fn of(text: &str, place: Option<&IssueLocation>) -> String {
        fingerprint("maps/a.xodr", "rule", &issue(text), place)
    }

    #[test]
    fn edits_around_finding_keep_its_fingerprint() {
        let before = of(
            "0.5 m too long",
            Some(&place(7, "/map/road[2]/lane[@id='-1']")),
        );
        let after = of(
            "0.7 m too long",
            Some(&place(9, "/map/road[3]/lane[@id='-1']")),
        );
        let reworded = of("it is long", Some(&place(9, "/map/road/lane[@id='-1']")));
        assert_eq!(before, after);
        assert_eq!(before, reworded);
        assert_eq!(before.len(), 2 * KEPT);
        assert_eq!(of("gap of -1.5e3 m", None), of("gap of 2.25e7 m", None));
    }

    #[test]
    fn different_findings_have_different_fingerprints() {
        let lane = |id: &str| place(7, &format!("/map/road[2]/lane[@id='{id}']"));
        let on_road = |id: &str| IssueLocation {
            road: Some((id.into(), 1.0, 2.0)),
            ..place(7, "/map/road[2]")
        };
        let elsewhere = |path: &str| IssueLocation {
            path: Some(path.into()),
            ..place(7, "/map/road[2]")
        };
        let all = [
            of("x", None),
            of("y", None),
            of("x", Some(&lane("-1"))),
            of("x", Some(&lane("-2"))),
            of("x", Some(&on_road("5"))),
            of("x", Some(&on_road("6"))),
            of("x", Some(&elsewhere("/one/b.xodr"))),
            fingerprint("maps/b.xodr", "rule", &issue("x"), None),
            fingerprint("maps/a.xodr", "rules", &issue("x"), None),
            fingerprint("maps/a.xodrr", "ule", &issue("x"), None),
        ];
        let different: std::collections::BTreeSet<_> = all.iter().collect();
        assert_eq!(different.len(), all.len());
        let other_machine = of("x", Some(&elsewhere("/two/b.xodr")));
        assert_eq!(other_machine, of("x", Some(&elsewhere("/one/b.xodr"))));
    }

    #[test]
    fn only_positional_predicates_are_removed() {
        for (xpath, kept) in [
            ("/a[1]/b[@id='2'][3]/@c", "/a/b[@id='2']/@c"),
            ("/a[@n='x[2]']/b[12]", "/a[@n='x[2]']/b"),
            ("/a[@n=\"it's ]\"][4]", "/a[@n=\"it's ]\"]"),
            ("/a[@n='never closed", "/a[@n='never closed"),
            ("]]][[", "]]]"),
            ("", ""),
        ] {
            assert_eq!(by_names(xpath), kept);
        }
    }

    #[test]
    fn fingerprint_is_stable_between_builds() {
        assert_eq!(fingerprint_of(&["a", "bc"]), fingerprint_of(&["a", "bc"]));
        assert_eq!(of("x", None), "7c68368f00d78326ca7c11445e6f2a11");
        let mut repeats = Repeats::default();
        let numbers = ["a", "b", "a"].map(|it| repeats.number(it));
        assert_eq!(numbers, [1, 1, 2]);
    }
}
