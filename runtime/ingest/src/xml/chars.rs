//! Character classes of XML 1.0 (fifth edition).

/// Bits of [`CLASS`].
pub(crate) const NAME_START: u8 = 1;
pub(crate) const NAME: u8 = 2;
pub(crate) const BLANK: u8 = 4;
/// Characters in an attribute value that need further processing: `&`, `<` and white space other
/// than a blank.
pub(crate) const SPECIAL: u8 = 8;
pub(crate) const DOUBLE_QUOTE: u8 = 16;
pub(crate) const SINGLE_QUOTE: u8 = 32;
pub(crate) const COLON: u8 = 64;
/// Bytes beyond ASCII.
pub(crate) const WIDE: u8 = 128;

/// Classes of each byte. Bytes from 0x80 on count as name characters here. Names with such bytes
/// are checked again, character by character.
pub(crate) static CLASS: [u8; 256] = classes();

const fn classes() -> [u8; 256] {
    let mut table = [0u8; 256];
    let mut byte = 0usize;
    while byte < 256 {
        table[byte] = match byte as u8 {
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => NAME_START | NAME,
            b':' => NAME_START | NAME | COLON,
            0x80..=0xFF => NAME_START | NAME | WIDE,
            b'0'..=b'9' | b'-' | b'.' => NAME,
            b' ' => BLANK,
            b'\t' | b'\n' | b'\r' => BLANK | SPECIAL,
            b'&' | b'<' => SPECIAL,
            b'"' => DOUBLE_QUOTE,
            b'\'' => SINGLE_QUOTE,
            _ => 0,
        };
        byte += 1;
    }
    table
}

/// Checks whether a byte has one of the classes.
#[inline]
pub(crate) fn is(byte: u8, class: u8) -> bool {
    CLASS[byte as usize] & class != 0
}

/// Checks whether a whole string is an XML `Name`. If so, returns whether it has a colon.
#[inline]
pub(crate) fn name_with_colon(name: &str) -> Option<bool> {
    let bytes = name.as_bytes();
    let first = *bytes.first()?;
    let (every, any) = bytes.iter().fold((NAME, 0), |(every, any), &byte| {
        let class = CLASS[byte as usize];
        (every & class, any | class)
    });
    let sound =
        is(first, NAME_START) && every & NAME != 0 && (any & WIDE == 0 || is_wide_name(name));
    sound.then_some(any & COLON != 0)
}

/// Checks `NameStartChar` and `NameChar` beyond ASCII.
pub(crate) fn is_wide_name(name: &str) -> bool {
    let start = |c: char| {
        c.is_ascii()
            || matches!(c,
                '\u{C0}'..='\u{D6}' | '\u{D8}'..='\u{F6}' | '\u{F8}'..='\u{2FF}'
                | '\u{370}'..='\u{37D}' | '\u{37F}'..='\u{1FFF}' | '\u{200C}'..='\u{200D}'
                | '\u{2070}'..='\u{218F}' | '\u{2C00}'..='\u{2FEF}' | '\u{3001}'..='\u{D7FF}'
                | '\u{F900}'..='\u{FDCF}' | '\u{FDF0}'..='\u{FFFD}' | '\u{10000}'..='\u{EFFFF}')
    };
    let inner = |c: char| {
        start(c) || matches!(c, '\u{B7}' | '\u{300}'..='\u{36F}' | '\u{203F}'..='\u{2040}')
    };
    let mut characters = name.chars();
    characters.next().is_some_and(start) && characters.all(inner)
}

/// Checks whether XML 1.0 allows the character (`Char`).
pub(crate) fn is_char(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | ' '..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..)
}

/// Returns the places of characters that XML forbids, in order.
pub(crate) fn forbidden(text: &str) -> impl Iterator<Item = (usize, char)> + '_ {
    const BLOCK: usize = 4096;
    let bytes = text.as_bytes();
    (0..bytes.len().div_ceil(BLOCK))
        .filter(move |number| {
            let block = &bytes[number * BLOCK..bytes.len().min((number + 1) * BLOCK)];
            is_suspicious(block)
        })
        .flat_map(move |number| forbidden_in(text, number * BLOCK, (number + 1) * BLOCK))
}

/// Checks whether a block may contain forbidden characters. It checks single bytes without an early
/// exit, so that the compiler generates vector code. Among others, U+FFFE and U+FFFF begin with
/// 0xEF.
fn is_suspicious(block: &[u8]) -> bool {
    let suspects = block.iter().fold(0u8, |any, &byte| {
        let blank = (byte == b'\t') | (byte == b'\n') | (byte == b'\r');
        any | u8::from(((byte < 0x20) & !blank) | (byte == 0xEF))
    });
    suspects != 0
}

fn forbidden_in(text: &str, from: usize, to: usize) -> impl Iterator<Item = (usize, char)> + '_ {
    let from = text.ceil_char_boundary(from);
    let to = text.ceil_char_boundary(to);
    let block = &text[from..to];
    block
        .char_indices()
        .filter(|&(_, c)| !is_char(c))
        .map(move |(at, c)| (from + at, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valid_xml_names_are_recognised() {
        let is_name = |name: &str| name_with_colon(name).is_some();
        assert_eq!(
            (name_with_colon("a:b"), name_with_colon("ab")),
            (Some(true), Some(false))
        );
        for name in ["a", "_x", "a:b", "road-1.2", "straße", "日本", "a\u{B7}b"] {
            assert!(is_name(name), "{name}");
        }
        for name in [
            "", "1a", "-a", ".a", "a b", "a<b", "\u{B7}a", "a×b", "a\u{0}",
        ] {
            assert!(!is_name(name), "{name}");
        }
    }

    #[test]
    fn forbidden_characters_are_found_across_blocks() {
        let mut text = "ü".repeat(5000);
        text.push('\u{0}');
        text.push_str(&" ".repeat(5000));
        text.push_str("\u{FFFF}\u{FFFD}\u{1}\t\r\n\u{7F}");
        let found: Vec<_> = forbidden(&text).collect();
        assert_eq!(
            found,
            [(10_000, '\u{0}'), (15_001, '\u{FFFF}'), (15_007, '\u{1}')]
        );
        assert_eq!(forbidden("").count(), 0);
    }
}
