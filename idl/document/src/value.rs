//! Parsing of numbers in attributes, spelt as in XML Schema.

use std::fmt;

use crate::attribute::Attribute;
use crate::node::Node;

/// Reason why an attribute gives no number. Its text names the element and the attribute;
/// [`node`](ValueError::node) and [`offset`](ValueError::offset) lead to the place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueError<'a> {
    /// The element has no such attribute.
    Missing {
        /// The element.
        node: Node<'a>,
        /// The missing attribute.
        name: &'a str,
    },
    /// The value is not a valid spelling of a number of that kind.
    Malformed {
        /// The attribute.
        attribute: Attribute<'a>,
        /// The expected kind of number.
        expected: NumberKind,
    },
    /// The value is spelt correctly but too large for the type.
    OutOfRange {
        /// The attribute.
        attribute: Attribute<'a>,
        /// The expected kind of number.
        expected: NumberKind,
    },
}

/// The kinds of numbers that a caller can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberKind {
    /// XML Schema's `double`.
    Double,
    /// XML Schema's `integer`, within 64 bits.
    Integer,
}

impl<'a> ValueError<'a> {
    /// Returns the element that should have the attribute.
    pub fn node(&self) -> Node<'a> {
        match self {
            ValueError::Missing { node, .. } => *node,
            ValueError::Malformed { attribute, .. } | ValueError::OutOfRange { attribute, .. } => {
                attribute.node()
            }
        }
    }

    /// Returns the name of the requested attribute.
    pub fn attribute_name(&self) -> &'a str {
        match self {
            ValueError::Missing { name, .. } => name,
            ValueError::Malformed { attribute, .. } | ValueError::OutOfRange { attribute, .. } => {
                attribute.name()
            }
        }
    }

    /// Returns the offset to point at: that of the attribute, or of the element that lacks it.
    pub fn offset(&self) -> u32 {
        match self {
            ValueError::Missing { node, .. } => node.offset(),
            ValueError::Malformed { attribute, .. } | ValueError::OutOfRange { attribute, .. } => {
                attribute.offset()
            }
        }
    }

    /// Checks whether the attribute is missing rather than wrong.
    pub fn is_missing(&self) -> bool {
        matches!(self, ValueError::Missing { .. })
    }
}

impl fmt::Display for ValueError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let element = self.node().name();
        let name = self.attribute_name();
        match self {
            ValueError::Missing { .. } => write!(f, "<{element}> has no attribute '{name}'"),
            ValueError::Malformed {
                attribute,
                expected,
            } => {
                write!(
                    f,
                    "attribute '{name}' of <{element}> is {}, ",
                    Shown(attribute.value())
                )?;
                expected.teach_spelling(attribute.value(), f)
            }
            ValueError::OutOfRange {
                attribute,
                expected,
            } => {
                write!(
                    f,
                    "attribute '{name}' of <{element}> is {}, ",
                    Shown(attribute.value())
                )?;
                f.write_str(expected.range())
            }
        }
    }
}

impl std::error::Error for ValueError<'_> {}

impl NumberKind {
    fn teach_spelling(self, value: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = trim(value);
        if value.is_empty() {
            return f.write_str("but a number is expected");
        }
        match self {
            NumberKind::Double
                if value.contains(',') && parse_double(&value.replace(',', ".")).is_ok() =>
            {
                f.write_str("which is not a number: the decimal separator is a point, as in 12.5")
            }
            NumberKind::Double
                if matches!(
                    &*value.to_ascii_lowercase(),
                    "inf" | "-inf" | "infinity" | "-infinity" | "nan"
                ) =>
            {
                f.write_str(
                    "which is not a number: write INF, -INF or NaN, in exactly this spelling",
                )
            }
            NumberKind::Double => {
                f.write_str("which is not a number; write it like 12.5 or -1.25e-3")
            }
            NumberKind::Integer => f.write_str("which is not an integer; write it like 12 or -3"),
        }
    }

    fn range(self) -> &'static str {
        match self {
            NumberKind::Double => "which is beyond the largest double, about 1.8e308",
            NumberKind::Integer => {
                "which is outside the range of 64-bit integers, -9223372036854775808 to 9223372036854775807"
            }
        }
    }
}

/// A value in quotes, truncated when it is long.
struct Shown<'a>(&'a str);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const LONGEST: usize = 60;
        match self.0 {
            "" => f.write_str("empty"),
            value => match value.char_indices().nth(LONGEST) {
                Some((cut, _)) => write!(f, "'{}…'", value.get(..cut).unwrap_or("")),
                None => write!(f, "'{value}'"),
            },
        }
    }
}

pub(crate) fn parse_f64(attribute: Attribute<'_>) -> Result<f64, ValueError<'_>> {
    parse_double(trim(attribute.value())).map_err(|wrong| wrong.of(attribute, NumberKind::Double))
}

pub(crate) fn parse_i64(attribute: Attribute<'_>) -> Result<i64, ValueError<'_>> {
    parse_integer(trim(attribute.value())).map_err(|wrong| wrong.of(attribute, NumberKind::Integer))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wrong {
    Spelling,
    Range,
}

impl Wrong {
    fn of(self, attribute: Attribute<'_>, expected: NumberKind) -> ValueError<'_> {
        match self {
            Wrong::Spelling => ValueError::Malformed {
                attribute,
                expected,
            },
            Wrong::Range => ValueError::OutOfRange {
                attribute,
                expected,
            },
        }
    }
}

/// Trims white space as XML defines it; Unicode defines more characters as white space.
fn trim(value: &str) -> &str {
    let is_space = |byte: Option<&u8>| matches!(byte, Some(b' ' | b'\t' | b'\n' | b'\r'));
    let bytes = value.as_bytes();
    if !is_space(bytes.first()) && !is_space(bytes.last()) {
        return value;
    }
    value.trim_matches([' ', '\t', '\n', '\r'])
}

/// Parses the lexical space of XML Schema 1.1's `double` (Datatypes, section 3.3.5.2).
fn parse_double(value: &str) -> Result<f64, Wrong> {
    match value {
        "INF" | "+INF" => return Ok(f64::INFINITY),
        "-INF" => return Ok(f64::NEG_INFINITY),
        "NaN" => return Ok(f64::NAN),
        _ => {}
    }
    // Rust's parser also accepts other spellings, such as "inf" and "nan".
    let decimal = value
        .bytes()
        .all(|byte| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E'));
    let number: f64 = if decimal {
        value.parse().map_err(|_| Wrong::Spelling)?
    } else {
        return Err(Wrong::Spelling);
    };
    if number.is_finite() {
        Ok(number)
    } else {
        Err(Wrong::Range)
    }
}

/// Parses the lexical space of XML Schema's `integer` (Datatypes, section 3.4.13).
fn parse_integer(value: &str) -> Result<i64, Wrong> {
    let digits = value.strip_prefix(['+', '-']).unwrap_or(value);
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(Wrong::Spelling);
    }
    value.parse().map_err(|_| Wrong::Range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_follow_xml_schema_spelling() {
        for (text, number) in [
            ("1", 1.0),
            ("+1.5", 1.5),
            ("-0", 0.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("1e3", 1000.0),
            ("1E-3", 0.001),
            ("INF", f64::INFINITY),
            ("-INF", f64::NEG_INFINITY),
            ("1e-999", 0.0),
        ] {
            assert_eq!(parse_double(text), Ok(number), "{text}");
        }
        assert!(parse_double("NaN").unwrap().is_nan());
        for text in [
            "", ".", "e5", "1e", "inf", "nan", "infinity", "1,5", "0x10", "1_000", "--1", "1 2",
            "٣", "1f",
        ] {
            assert_eq!(parse_double(text), Err(Wrong::Spelling), "{text}");
        }
        assert_eq!(parse_double("1e999"), Err(Wrong::Range));
        assert_eq!(parse_double("-1e999"), Err(Wrong::Range));
    }

    #[test]
    fn integers_follow_xml_schema_spelling() {
        for (text, number) in [
            ("0", 0),
            ("+7", 7),
            ("-007", -7),
            ("9223372036854775807", i64::MAX),
        ] {
            assert_eq!(parse_integer(text), Ok(number), "{text}");
        }
        for text in ["", "+", "-", "1.0", "1e3", "+-1", " 1"] {
            assert_eq!(parse_integer(text), Err(Wrong::Spelling), "{text}");
        }
        assert_eq!(parse_integer("9223372036854775808"), Err(Wrong::Range));
    }

    #[test]
    fn only_xml_white_space_is_trimmed() {
        assert_eq!(trim(" \t\r\n1 "), "1");
        assert_eq!(trim("\u{a0}1"), "\u{a0}1");
    }
}
