//! Text helpers that several parts of the model use.

/// Trims XML white space around the text.
pub(crate) fn trim(text: &str) -> &str {
    text.trim_matches([' ', '\t', '\r', '\n'])
}

/// Checks whether the text is a valid parameter name: `[A-Za-z_][A-Za-z0-9_]*`.
pub fn is_identifier(text: &str) -> bool {
    !text.is_empty() && identifier(text).len() == text.len()
}

/// Returns a name without the `$` that old files write before it.
pub fn bare(name: &str) -> &str {
    name.strip_prefix('$').unwrap_or(name)
}

/// Returns the longest parameter name at the start of a text, or an empty text.
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
