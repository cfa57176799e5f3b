//! Conversion of untrusted text into a form that XML writers and readers do not change.

use qcbus_messages::shown;
use qcbus_reporter_sdk::one_line;

/// Returns the text on one line, cut after `most` characters; a sign marks a cut.
pub(crate) fn short(text: &str, most: usize) -> String {
    let line = legal(&one_line(text));
    match line.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", line.get(..end).unwrap_or_default().trim_end()),
        None => line,
    }
}

/// Returns a path or a name on one line, as exactly as XML allows.
pub(crate) fn path(text: &str) -> String {
    legal(&shown::line(text))
}

/// Returns a name that is never empty, because hosts drop a case or a suite without a name.
pub(crate) fn name(text: &str, otherwise: &str) -> String {
    match path(text) {
        name if name.trim().is_empty() => otherwise.to_owned(),
        name => name,
    }
}

/// Replaces the two other characters that XML forbids. No control characters are left here.
fn legal(text: &str) -> String {
    text.replace(['\u{FFFE}', '\u{FFFF}'], "\u{FFFD}")
}

/// Returns the count with its noun: `1 finding`, `2 findings`.
pub(crate) fn counted(count: usize, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}

#[cfg(test)]
mod tests {
    use quick_junit::XmlString;

    use super::*;

    #[test]
    fn text_is_unchanged_by_xml_sanitizing() {
        // quick-junit removes escape sequences and control characters. None may be left for it
        // here.
        let all: String = ('\0'..=char::MAX).collect();
        for text in [short(&all, usize::MAX), path(&all)] {
            assert_eq!(XmlString::new(&text).as_str(), text);
            assert!(!text.contains(['\u{FFFE}', '\u{FFFF}', '\r', '\n', '\t']));
        }
        assert_eq!(
            short("a\u{1b}[31mb\u{9b}2Kc", 99),
            "a\u{FFFD}[31mb\u{FFFD}2Kc"
        );
    }

    #[test]
    fn long_text_is_cut_between_characters() {
        assert_eq!(short("äöü", 3), "äöü");
        assert_eq!(short("äö ü", 3), "äö…");
        assert_eq!(short("", 3), "");
    }

    #[test]
    fn empty_name_gets_replacement_text() {
        assert_eq!(name(" \u{3000}", "(no id)"), "(no id)");
        assert_eq!(name("a\nb", "(no id)"), "a\\nb");
    }
}
