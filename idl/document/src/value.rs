//! Parsing of numbers in attributes, spelt as in XML Schema.

use std::fmt;

/// The kinds of numbers that a caller can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberKind {
    /// XML Schema's `double`.
    Double,
    /// XML Schema's `integer`, within 64 bits.
    Integer,
}

impl NumberKind {
    pub(crate) fn teach_spelling(self, value: &str, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

    pub(crate) fn range(self) -> &'static str {
        match self {
            NumberKind::Double => "which is beyond the largest double, about 1.8e308",
            NumberKind::Integer => {
                "which is outside the range of 64-bit integers, -9223372036854775808 to 9223372036854775807"
            }
        }
    }
}

/// A value in quotes, truncated when it is long.
pub(crate) struct Shown<'a>(pub(crate) &'a str);

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

/// What is wrong with a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrong {
    /// Its spelling.
    Spelling,
    /// Its size.
    Range,
}

/// Trims white space as XML defines it; Unicode defines more characters as white space.
pub(crate) fn trim(value: &str) -> &str {
    let is_space = |byte: Option<&u8>| matches!(byte, Some(b' ' | b'\t' | b'\n' | b'\r'));
    let bytes = value.as_bytes();
    if !is_space(bytes.first()) && !is_space(bytes.last()) {
        return value;
    }
    value.trim_matches([' ', '\t', '\n', '\r'])
}

/// Parses the lexical space of XML Schema 1.1's `double` (Datatypes, section 3.3.5.2).
pub(crate) fn parse_double(value: &str) -> Result<f64, Wrong> {
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
pub(crate) fn parse_integer(value: &str) -> Result<i64, Wrong> {
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
