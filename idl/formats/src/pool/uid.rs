//! The shape of a rule UID.

/// Whether the text is a rule UID as ASAM's readers accept it:
/// `entity.tld:standard:1.2.3:set.of.rules.name`.
pub fn is_rule_uid(text: &str) -> bool {
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

/// The number of words between dots; 0 when one is empty or not as it should be.
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
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    word.bytes().all(plain) || word.chars().all(|c| c.is_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::is_rule_uid;

    #[test]
    fn follows_the_published_pattern() {
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
}
