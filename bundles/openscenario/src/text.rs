//! Spellings that several parts of the model ask for.

/// The text without XML's white space around it.
pub(crate) fn trim(text: &str) -> &str {
    text.trim_matches([' ', '\t', '\r', '\n'])
}

/// Whether the text is a name as parameters have it: `[A-Za-z_][A-Za-z0-9_]*`.
pub fn is_identifier(text: &str) -> bool {
    !text.is_empty() && identifier(text).len() == text.len()
}

/// The longest name of a parameter that a text begins with; empty when it begins with none.
pub fn identifier(text: &str) -> &str {
    let starts = |byte: u8| byte.is_ascii_alphabetic() || byte == b'_';
    if !text.as_bytes().first().is_some_and(|byte| starts(*byte)) {
        return "";
    }
    let end = text
        .bytes()
        .position(|byte| !(starts(byte) || byte.is_ascii_digit()))
        .unwrap_or(text.len());
    &text[..end]
}
