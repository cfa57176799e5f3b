//! Reads the attributes of a start tag one by one, with the checks that quick-xml's own iterator
//! omits.

use std::ops::Range;

use qcbus_document::FaultCode;

use super::chars::{
    BLANK, CLASS, COLON, DOUBLE_QUOTE, NAME, NAME_START, SINGLE_QUOTE, SPECIAL, WIDE, is,
    is_wide_name,
};

/// One attribute. The ranges are offsets in the scanned text.
pub(crate) struct RawAttribute {
    pub name: Range<usize>,
    /// Value without the quotes, with unresolved entities.
    pub value: Range<usize>,
    /// Whether the value contains `&`, `<`, a tab or a line end.
    pub special: bool,
    /// Whether the name has a colon.
    pub colon: bool,
    /// Whether no white space separates this attribute from the text before it.
    pub missing_space: bool,
}

/// Reason why the rest of a tag cannot be read.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct TagFault {
    pub code: FaultCode,
    pub offset: usize,
    pub text: String,
}

/// Iterates over the attributes of one tag. After an error it is finished.
pub(crate) struct AttributeScanner<'t> {
    text: &'t str,
    at: usize,
    end: usize,
    /// Whether the tag has no special characters, so that the scanner looks only for quotes.
    plain: bool,
}

impl<'t> AttributeScanner<'t> {
    /// Scans `inside`: the text after the element's name, up to but without `>` or `/>`.
    pub fn new(text: &'t str, inside: Range<usize>) -> AttributeScanner<'t> {
        let end = inside.end.min(text.len());
        let at = inside.start.min(end);
        let plain = is_plain(&text.as_bytes()[at..end]);
        AttributeScanner {
            text,
            at,
            end,
            plain,
        }
    }

    #[inline]
    fn run(&self, from: usize, class: u8) -> usize {
        let bytes = &self.text.as_bytes()[from..self.end];
        from + bytes
            .iter()
            .position(|&byte| !is(byte, class))
            .unwrap_or(bytes.len())
    }

    #[inline]
    fn byte(&self, at: usize) -> Option<u8> {
        if at < self.end {
            self.text.as_bytes().get(at).copied()
        } else {
            None
        }
    }

    #[inline]
    fn scan(&mut self) -> Result<Option<RawAttribute>, TagFault> {
        let start = self.run(self.at, BLANK);
        if start == self.end {
            return Ok(None);
        }
        let missing_space = start == self.at;
        let (name, colon) = self.name(start)?;
        let equals = self.run(name.end, BLANK);
        if self.byte(equals) != Some(b'=') {
            return Err(self.no_value(name));
        }
        let quote_at = self.run(equals + 1, BLANK);
        let quote = match self.byte(quote_at) {
            Some(quote @ (b'"' | b'\'')) => quote,
            _ => return Err(self.unquoted(quote_at, name)),
        };
        let (value, special) = self.value(quote_at + 1, quote)?;
        self.at = value.end + 1;
        Ok(Some(RawAttribute {
            name,
            value,
            special,
            colon,
            missing_space,
        }))
    }

    #[inline]
    fn name(&self, start: usize) -> Result<(Range<usize>, bool), TagFault> {
        let bytes = &self.text.as_bytes()[start..self.end];
        let (mut seen, mut len) = (0, 0);
        for &byte in bytes {
            let class = CLASS[byte as usize];
            if class & NAME == 0 {
                break;
            }
            seen |= class;
            len += 1;
        }
        let sound = len > 0 && is(bytes[0], NAME_START);
        if !sound || (seen & WIDE != 0 && !is_wide_name(&self.text[start..start + len])) {
            return Err(self.bad_name(start));
        }
        Ok((start..start + len, seen & COLON != 0))
    }

    #[inline]
    fn value(&self, start: usize, quote: u8) -> Result<(Range<usize>, bool), TagFault> {
        let closing = if quote == b'"' {
            DOUBLE_QUOTE
        } else {
            SINGLE_QUOTE
        };
        let bytes = &self.text.as_bytes()[start..self.end];
        if self.plain {
            return match find_quote(bytes, quote) {
                Some(len) => Ok((start..start + len, false)),
                None => Err(self.unclosed(start)),
            };
        }
        let mut seen = 0u8;
        for (len, &byte) in bytes.iter().enumerate() {
            let class = CLASS[byte as usize];
            if class & closing != 0 {
                return Ok((start..start + len, seen & SPECIAL != 0));
            }
            seen |= class;
        }
        Err(self.unclosed(start))
    }

    #[cold]
    fn unclosed(&self, start: usize) -> TagFault {
        let text = "the attribute's value has no closing quote".to_string();
        TagFault {
            code: FaultCode::BadAttribute,
            offset: start.saturating_sub(1),
            text,
        }
    }

    #[cold]
    fn bad_name(&self, offset: usize) -> TagFault {
        let rest = &self.text[self.text.ceil_char_boundary(offset)..self.end];
        let word = rest
            .split([' ', '\t', '\n', '\r', '=', '>'])
            .next()
            .unwrap_or(rest);
        let shown: String = word.chars().take(40).collect();
        let text = if shown.is_empty() {
            "an attribute's name is missing".to_string()
        } else {
            format!("{shown:?} is not a valid attribute name")
        };
        TagFault {
            code: FaultCode::BadName,
            offset,
            text,
        }
    }

    #[cold]
    fn no_value(&self, name: Range<usize>) -> TagFault {
        let text = format!("the attribute `{}` has no value", &self.text[name.clone()]);
        TagFault {
            code: FaultCode::BadAttribute,
            offset: name.start,
            text,
        }
    }

    #[cold]
    fn unquoted(&self, offset: usize, name: Range<usize>) -> TagFault {
        let name = &self.text[name];
        let rest = &self.text[self.text.ceil_char_boundary(offset)..self.end];
        // Word processors replace straight quotes.
        let text = match rest.starts_with(['“', '”', '„', '‘', '’']) {
            true => format!("the value of the attribute `{name}` has typographic quotes; use \""),
            false => format!("the value of the attribute `{name}` is not in quotes"),
        };
        TagFault {
            code: FaultCode::BadAttribute,
            offset,
            text,
        }
    }
}

/// Checks whether none of the bytes is [`SPECIAL`]. It has no early exit, so that the compiler can
/// generate vector code.
#[inline]
fn is_plain(bytes: &[u8]) -> bool {
    let special = |byte: u8| (byte < b' ') | (byte == b'&') | (byte == b'<');
    !bytes.iter().fold(false, |any, &byte| any | special(byte))
}

/// Finds the first quote, eight bytes at a time. Values are too short for a call of `memchr`.
#[inline]
fn find_quote(bytes: &[u8], quote: u8) -> Option<usize> {
    const ONES: u64 = u64::from_le_bytes([0x01; 8]);
    const HIGHS: u64 = u64::from_le_bytes([0x80; 8]);
    let wanted = ONES * u64::from(quote);
    let (words, rest) = bytes.as_chunks::<8>();
    for (number, word) in words.iter().enumerate() {
        // The lowest marked byte is the first one that equals the quote.
        let differing = u64::from_le_bytes(*word) ^ wanted;
        let marked = differing.wrapping_sub(ONES) & !differing & HIGHS;
        if marked != 0 {
            return Some(number * 8 + marked.trailing_zeros() as usize / 8);
        }
    }
    let at = rest.iter().position(|&byte| byte == quote)?;
    Some(words.len() * 8 + at)
}

impl Iterator for AttributeScanner<'_> {
    type Item = Result<RawAttribute, TagFault>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        match self.scan() {
            Ok(found) => found.map(Ok),
            Err(fault) => {
                self.at = self.end;
                Some(Err(fault))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Name, value, special, missing space.
    type Scanned<'t> = (&'t str, &'t str, bool, bool);

    fn scan(inside: &str) -> (Vec<Scanned<'_>>, Option<TagFault>) {
        let mut found = Vec::new();
        for attribute in AttributeScanner::new(inside, 0..inside.len()) {
            match attribute {
                Ok(a) => found.push((
                    &inside[a.name],
                    &inside[a.value],
                    a.special,
                    a.missing_space,
                )),
                Err(fault) => return (found, Some(fault)),
            }
        }
        (found, None)
    }

    #[test]
    fn attributes_with_any_spacing_are_read() {
        let (found, fault) = scan(" a=\"1\"\n\tb = '\"'  xml:c=\"x&amp;\ty\"d='' ");
        assert_eq!(fault, None);
        assert_eq!(
            found,
            [
                ("a", "1", false, false),
                ("b", "\"", false, false),
                ("xml:c", "x&amp;\ty", true, false),
                ("d", "", false, true)
            ]
        );
        assert_eq!(scan("").0, []);
        assert_eq!(scan(" \n").0, []);
    }

    #[test]
    fn invalid_attribute_ends_the_tag() {
        let cases = [
            (
                " a",
                FaultCode::BadAttribute,
                1,
                "the attribute `a` has no value",
            ),
            (
                " a b='1'",
                FaultCode::BadAttribute,
                1,
                "the attribute `a` has no value",
            ),
            (
                " a=1",
                FaultCode::BadAttribute,
                3,
                "the value of the attribute `a` is not in quotes",
            ),
            (
                " a=",
                FaultCode::BadAttribute,
                3,
                "the value of the attribute `a` is not in quotes",
            ),
            (
                " a=“1”",
                FaultCode::BadAttribute,
                3,
                "the value of the attribute `a` has typographic quotes; use \"",
            ),
            (
                " a='1",
                FaultCode::BadAttribute,
                3,
                "the attribute's value has no closing quote",
            ),
            (
                " 1a='1'",
                FaultCode::BadName,
                1,
                "\"1a\" is not a valid attribute name",
            ),
            (
                " ×='1'",
                FaultCode::BadName,
                1,
                "\"×\" is not a valid attribute name",
            ),
            (
                " ='1'",
                FaultCode::BadName,
                1,
                "an attribute's name is missing",
            ),
            (
                " /",
                FaultCode::BadName,
                1,
                "\"/\" is not a valid attribute name",
            ),
        ];
        for (inside, code, offset, text) in cases {
            let (_, fault) = scan(inside);
            assert_eq!(
                fault,
                Some(TagFault {
                    code,
                    offset,
                    text: text.to_string()
                }),
                "{inside}"
            );
        }
        assert_eq!(
            scan(" a='1' b=2 c='3'").0.len(),
            1,
            "attributes before the fault are kept"
        );
    }
}
