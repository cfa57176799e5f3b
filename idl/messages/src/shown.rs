//! Makes foreign text safe to show to people and to programs that read line by line.
//!
//! Names, reasons, descriptions and source lines come from untrusted files and processes. If they
//! were printed unchanged, an escape sequence could recolour or rewrite a terminal. A bidirectional
//! override could show a different text, and a line break could imitate a line of qcbus. Paths have
//! a reversible form of their own: [`crate::path_text`]. JSON, results and the journal store texts
//! unchanged.

use std::borrow::Cow;

/// Checks whether a terminal or a line-based reader interprets this as more than a character:
/// control characters, line and paragraph separators, changes of the writing direction.
pub fn moves(c: char) -> bool {
    let directed = ['\u{202a}'..='\u{202e}', '\u{2066}'..='\u{2069}'];
    c.is_control()
        || matches!(c, '\u{2028}' | '\u{2029}')
        || directed.iter().any(|it| it.contains(&c))
}

/// Returns the text on one line. Every character that [`moves`] is written as `\n`, `\u{1b}` and so
/// on.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, moves)
}

/// Returns the text with its own lines and tabs. All other characters that [`moves`] matches are
/// written as by [`line()`].
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| moves(c) && c != '\n' && c != '\t')
}

fn escaped(text: &str, unsafe_to_show: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(&unsafe_to_show) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if unsafe_to_show(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn control_characters_are_escaped_and_other_text_is_kept() {
        let cases = [
            ("straße \\ 100 %", "straße \\ 100 %", "straße \\ 100 %"),
            ("a\nb: accepted", "a\\nb: accepted", "a\nb: accepted"),
            ("a\r\n\tb", "a\\r\\n\\tb", "a\\r\n\tb"),
            ("\u{1b}[2Ka", "\\u{1b}[2Ka", "\\u{1b}[2Ka"),
            ("\u{9b}2K", "\\u{9b}2K", "\\u{9b}2K"),
            (
                "a\u{202e}b\u{2069}",
                "a\\u{202e}b\\u{2069}",
                "a\\u{202e}b\\u{2069}",
            ),
            (
                "a\u{2028}b\u{85}",
                "a\\u{2028}b\\u{85}",
                "a\\u{2028}b\\u{85}",
            ),
            ("\0\u{7f}", "\\u{0}\\u{7f}", "\\u{0}\\u{7f}"),
        ];
        for (text, one, several) in cases {
            assert_eq!((&*line(text), &*lines(text)), (one, several));
        }
    }

    proptest! {
        #[test]
        fn shown_text_has_no_control_characters(text in any::<String>()) {
            prop_assert!(!line(&text).chars().any(moves));
            prop_assert!(!lines(&text).chars().any(|c| moves(c) && c != '\n' && c != '\t'));
        }
    }
}
