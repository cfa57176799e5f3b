//! Text of others, made safe to show.
//!
//! Descriptions, paths and source lines come from the files that are checked. Printed as they
//! are, an escape sequence could recolour or rewrite a terminal, and a bidirectional override
//! could show another text than the file holds. What steers is known in one place
//! ([`qcbus_messages::shown`]); here it becomes one character each, so that columns stay.

use qcbus_messages::shown::moves;

/// The text with everything that steers a terminal replaced by U+FFFD; tabs and line feeds stay.
pub fn printable(text: &str) -> String {
    text.replace("\r\n", "\n")
        .chars()
        .map(|c| if steers(c) { '\u{FFFD}' } else { c })
        .collect()
}

/// The text on one line: white space runs become one blank, the rest as by [`printable`].
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
    fn escape_sequences_and_overrides_do_not_get_through() {
        assert_eq!(
            printable("a\u{1b}[31mb\u{202e}c\r\nd\te\u{2028}f"),
            "a\u{FFFD}[31mb\u{FFFD}c\nd\te\u{FFFD}f"
        );
    }

    #[test]
    fn one_line_is_one_line() {
        assert_eq!(one_line("  a\n\t b\u{7} "), "a b\u{FFFD}");
    }
}
