//! Escapes values for XML.

use std::fmt::Write as _;

use super::chars::is_char;

/// Appends a value in the form needed between two quotes of this kind, so that every reader gets
/// the same value back. Characters that XML forbids become U+FFFD.
pub(crate) fn escape_into(out: &mut String, value: &str, quote: char) {
    for c in value.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' if quote == '"' => out.push_str("&quot;"),
            '\'' if quote == '\'' => out.push_str("&apos;"),
            // Without a character reference, readers would turn this white space into blanks.
            '\t' | '\n' | '\r' => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            c if is_char(c) => out.push(c),
            _ => out.push('\u{FFFD}'),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escaped_value_is_read_back_unchanged() {
        for quote in ['"', '\''] {
            let mut out = String::new();
            escape_into(&mut out, "a<b> & \"c\" 'd'\t\n\u{1}ü", quote);
            let other = if quote == '"' {
                "&quot;c&quot; 'd'"
            } else {
                "\"c\" &apos;d&apos;"
            };
            assert_eq!(out, format!("a&lt;b> &amp; {other}&#9;&#10;\u{FFFD}ü"));
        }
    }
}
