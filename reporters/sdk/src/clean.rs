//! Sanitizing of untrusted text for display.
//!
//! Descriptions, paths and source lines come from the checked files. In unmodified output, an
//! escape sequence could recolour or rewrite a terminal. A bidirectional override could show a text
//! that differs from the file. The control characters are defined in one place
//! ([`qcbus_messages::shown`]). Here each of them becomes one character, so columns stay the same.

use qcbus_messages::shown::moves;

/// Replaces everything that controls a terminal by U+FFFD; tabs and line feeds stay.
pub fn printable(text: &str) -> String {
    text.replace("\r\n", "\n")
        .chars()
        .map(|c| if steers(c) { '\u{FFFD}' } else { c })
        .collect()
}

/// Returns the text on one line: white space runs become one space, the rest as in [`printable`].
pub fn one_line(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    printable(&words.join(" "))
}

fn steers(c: char) -> bool {
    moves(c) && c != '\t' && c != '\n'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_sequences_and_overrides_are_replaced() {
        assert_eq!(
            printable("a\u{1b}[31mb\u{202e}c\r\nd\te\u{2028}f"),
            "a\u{FFFD}[31mb\u{FFFD}c\nd\te\u{FFFD}f"
        );
    }

    #[test]
    fn text_is_joined_to_single_line() {
        assert_eq!(one_line("  a\n\t b\u{7} "), "a b\u{FFFD}");
    }
}
