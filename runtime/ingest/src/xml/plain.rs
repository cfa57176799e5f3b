//! Reads tags in plain spelling in one step: `<name a="1" b='2'/>` and `</name>`. Nearly all tags
//! are plain. Tags in any other spelling are left to quick-xml and [`AttributeScanner`].
//!
//! [`AttributeScanner`]: super::tag::AttributeScanner

use super::chars::{
    BLANK, CLASS, COLON, DOUBLE_QUOTE, NAME, NAME_START, SINGLE_QUOTE, SPECIAL, WIDE, is,
};
use super::tag::RawAttribute;

/// A start tag in plain spelling. Offsets refer to the text.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct PlainTag {
    /// Offset after the last letter of its name.
    pub name_end: usize,
    /// The name has a colon.
    pub colon: bool,
    /// Offset after its `>`.
    pub end: usize,
    /// Whether it is also an end tag.
    pub empty: bool,
}

/// Reads the start tag whose `<` is at `from`, and puts its attributes into `attributes`. Returns
/// `None` if it is not a start tag in plain spelling.
#[inline]
pub(crate) fn start_tag(
    text: &[u8],
    from: usize,
    attributes: &mut Vec<RawAttribute>,
) -> Option<PlainTag> {
    attributes.clear();
    let (name_end, colon) = name(text, from + 1)?;
    let mut at = name_end;
    loop {
        let start = skip_blanks(text, at);
        match *text.get(start)? {
            b'>' => {
                let (end, empty) = (start + 1, false);
                return Some(PlainTag {
                    name_end,
                    colon,
                    end,
                    empty,
                });
            }
            b'/' if text.get(start + 1) == Some(&b'>') => {
                let (end, empty) = (start + 2, true);
                return Some(PlainTag {
                    name_end,
                    colon,
                    end,
                    empty,
                });
            }
            // The missing space is a fault, which the slow path reports.
            _ if start == at => return None,
            _ => {}
        }
        let attribute = attribute(text, start)?;
        at = attribute.value.end + 1;
        attributes.push(attribute);
    }
}

/// Checks for the plain end tag of an element of this name at `from`. If found, returns the offset
/// after its `>`.
#[inline]
pub(crate) fn end_tag(text: &[u8], from: usize, name: &str) -> Option<usize> {
    let end = from + 2 + name.len();
    let written = text.get(from + 2..end)?;
    (text.get(end) == Some(&b'>') && written == name.as_bytes()).then_some(end + 1)
}

/// Returns the offset of the first byte from `at` on that is not white space, or the end. It is
/// fast for long runs of blanks.
#[inline]
pub(crate) fn skip_indent(text: &[u8], mut at: usize) -> usize {
    const BLANKS: [u8; 8] = [b' '; 8];
    if text.get(at) == Some(&b'\n') {
        at += 1;
    }
    while text.get(at..).and_then(|rest| rest.first_chunk::<8>()) == Some(&BLANKS) {
        at += 8;
    }
    skip_blanks(text, at)
}

#[inline]
fn skip_blanks(text: &[u8], mut at: usize) -> usize {
    while text.get(at).is_some_and(|&byte| is(byte, BLANK)) {
        at += 1;
    }
    at
}

#[inline]
fn attribute(text: &[u8], start: usize) -> Option<RawAttribute> {
    let (name_end, colon) = name(text, start)?;
    if text.get(name_end) != Some(&b'=') {
        return None;
    }
    let value_at = name_end + 2;
    let (value_end, special) = match *text.get(name_end + 1)? {
        b'"' => value::<b'"'>(text, value_at)?,
        b'\'' => value::<b'\''>(text, value_at)?,
        _ => return None,
    };
    Some(RawAttribute {
        name: start..name_end,
        value: value_at..value_end,
        special,
        colon,
        missing_space: false,
    })
}

/// Returns the end of a name of ASCII letters, and whether it has a colon.
#[inline]
fn name(text: &[u8], start: usize) -> Option<(usize, bool)> {
    let first = CLASS[usize::from(*text.get(start)?)];
    if first & NAME_START == 0 {
        return None;
    }
    let (mut seen, mut end) = (first, start + 1);
    loop {
        let class = CLASS[usize::from(*text.get(end)?)];
        if class & NAME == 0 {
            break;
        }
        seen |= class;
        end += 1;
    }
    (seen & WIDE == 0).then_some((end, seen & COLON != 0))
}

/// Returns the closing quote of a value that begins at `start`, and whether the value is special.
#[inline]
fn value<const QUOTE: u8>(text: &[u8], start: usize) -> Option<(usize, bool)> {
    let mut at = start;
    while let Some(word) = text.get(at..).and_then(|rest| rest.first_chunk::<8>()) {
        let marks = suspects::<QUOTE>(u64::from_le_bytes(*word));
        if marks != 0 {
            at += marks.trailing_zeros() as usize / 8;
            if text.get(at) == Some(&QUOTE) {
                return Some((at, false));
            }
            break;
        }
        at += 8;
    }
    let closing = if QUOTE == b'"' {
        DOUBLE_QUOTE
    } else {
        SINGLE_QUOTE
    };
    let mut seen = 0u8;
    for (end, &byte) in text.iter().enumerate().skip(at) {
        let class = CLASS[usize::from(byte)];
        if class & closing != 0 {
            return Some((end, seen & SPECIAL != 0));
        }
        seen |= class;
    }
    None
}

/// Marks the bytes of a word that end a value or may be special: the quote, `&`, `<` and all bytes
/// below the blank. The lowest mark is exact. Marks above it may be false.
#[inline]
fn suspects<const QUOTE: u8>(word: u64) -> u64 {
    const ONES: u64 = u64::from_le_bytes([0x01; 8]);
    const HIGHS: u64 = u64::from_le_bytes([0x80; 8]);
    let zeroes = |word: u64| word.wrapping_sub(ONES) & !word;
    let equal = |byte: u8| zeroes(word ^ (ONES * u64::from(byte)));
    let low = word.wrapping_sub(ONES * u64::from(b' ')) & !word;
    (equal(QUOTE) | equal(b'&') | equal(b'<') | low) & HIGHS
}
