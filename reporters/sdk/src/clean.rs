//! Text of others, made safe to show.
//!
//! Descriptions, paths and source lines come from the files that are checked. Printed as they
//! are, an escape sequence could recolour or rewrite a terminal, and a bidirectional override
//! could show another text than the file holds.

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
    let bidirectional = matches!(c, '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    (c.is_control() && c != '\t' && c != '\n') || bidirectional
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_sequences_and_overrides_do_not_get_through() {
        assert_eq!(
            printable("a\u{1b}[31mb\u{202e}c\r\nd\te"),
            "a\u{FFFD}[31mb\u{FFFD}c\nd\te"
        );
    }

    #[test]
    fn one_line_is_one_line() {
        assert_eq!(one_line("  a\n\t b\u{7} "), "a b\u{FFFD}");
    }
}
