//! Data types of attributes and parameters, and their values.

use std::borrow::Cow;

use crate::expr;
use crate::types::date_time::DateTime;
use crate::types::text::trim;

/// A basic data type (OpenSCENARIO XML, "Data types").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DataType {
    /// `true`, `false`, `1`, `0`
    Boolean,
    /// A 64-bit floating point number. `INF`, `-INF` and `NaN` are allowed.
    Double,
    /// A signed 32-bit integer. It is called `integer` before 1.2.
    Int,
    /// An unsigned 32-bit integer.
    UnsignedInt,
    /// An unsigned 16-bit integer.
    UnsignedShort,
    /// Any text.
    String,
    /// A point in time.
    DateTime,
}

impl DataType {
    /// Returns the type that a `parameterType` or `variableType` names.
    pub fn of_declaration(word: &str) -> Option<DataType> {
        Some(match word {
            "boolean" => DataType::Boolean,
            "double" => DataType::Double,
            "int" | "integer" => DataType::Int,
            "unsignedInt" => DataType::UnsignedInt,
            "unsignedShort" => DataType::UnsignedShort,
            "string" => DataType::String,
            "dateTime" => DataType::DateTime,
            _ => return None,
        })
    }

    /// Returns the type with this name in the schemas, or `None` for enumerations.
    pub fn of_schema(name: &str) -> Option<DataType> {
        Some(match name {
            "Boolean" => DataType::Boolean,
            "Double" => DataType::Double,
            "Int" | "Integer" => DataType::Int,
            "UnsignedInt" => DataType::UnsignedInt,
            "UnsignedShort" => DataType::UnsignedShort,
            "String" => DataType::String,
            "DateTime" => DataType::DateTime,
            _ => return None,
        })
    }

    /// Returns the name of the type in `parameterType`.
    pub fn word(self) -> &'static str {
        match self {
            DataType::Boolean => "boolean",
            DataType::Double => "double",
            DataType::Int => "int",
            DataType::UnsignedInt => "unsignedInt",
            DataType::UnsignedShort => "unsignedShort",
            DataType::String => "string",
            DataType::DateTime => "dateTime",
        }
    }

    /// Checks whether values of the type are numbers.
    pub fn is_numeric(self) -> bool {
        !matches!(
            self,
            DataType::Boolean | DataType::String | DataType::DateTime
        )
    }

    /// Checks whether values of the type are ordered. This holds for numbers and points in time.
    pub fn is_ordered(self) -> bool {
        self.is_numeric() || self == DataType::DateTime
    }

    /// Returns the allowed notation for messages.
    pub fn allowed(self) -> &'static str {
        match self {
            DataType::Boolean => "`true` or `false`",
            DataType::Double => "a number",
            DataType::Int => "a whole number from -2147483648 to 2147483647",
            DataType::UnsignedInt => "a whole number from 0 to 4294967295",
            DataType::UnsignedShort => "a whole number from 0 to 65535",
            DataType::String => "a text",
            DataType::DateTime => "a date and time such as 2026-01-31T18:30:00",
        }
    }

    /// Returns the range of integers of the type.
    pub fn range(self) -> Option<std::ops::RangeInclusive<i64>> {
        match self {
            DataType::Int => Some(i64::from(i32::MIN)..=i64::from(i32::MAX)),
            DataType::UnsignedInt => Some(0..=i64::from(u32::MAX)),
            DataType::UnsignedShort => Some(0..=i64::from(u16::MAX)),
            DataType::Boolean | DataType::Double | DataType::String | DataType::DateTime => None,
        }
    }

    /// Parses a literal of the type. Returns `None` if the text is no such literal.
    pub fn parse<'d>(self, text: &'d str) -> Option<Value<'d>> {
        match self {
            DataType::Boolean => parse_boolean(text).map(Value::Boolean),
            DataType::Double => parse_double(text).map(Value::Double),
            DataType::String => Some(Value::Text(Cow::Borrowed(text))),
            DataType::DateTime => DateTime::parse(text)
                .ok()
                .map(|_| Value::Text(trim(text).into())),
            DataType::Int | DataType::UnsignedInt | DataType::UnsignedShort => {
                let value = parse_integer(text)?;
                self.range()?
                    .contains(&value)
                    .then_some(Value::Integer(value))
            }
        }
    }
}

/// A resolved value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value<'d> {
    /// A value of one of the integer types.
    Integer(i64),
    /// A value of type double. It may be infinite or NaN.
    Double(f64),
    /// A value of type boolean.
    Boolean(bool),
    /// A value of type string or dateTime.
    Text(Cow<'d, str>),
}

impl<'d> Value<'d> {
    /// Returns the value as text, in the notation of an author.
    pub fn text(&self) -> Cow<'d, str> {
        match self {
            Value::Integer(value) => Cow::Owned(value.to_string()),
            Value::Double(value) => Cow::Owned(write_double(*value)),
            Value::Boolean(value) => Cow::Borrowed(if *value { "true" } else { "false" }),
            Value::Text(text) => text.clone(),
        }
    }

    /// Returns the value as a number. A text that contains a number counts.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Integer(value) => Some(*value as f64),
            Value::Double(value) => Some(*value),
            Value::Boolean(_) => None,
            Value::Text(text) => parse_double(text),
        }
    }

    /// Returns the value as an integer. A double without a fraction counts, and so does a text that
    /// contains an integer.
    pub fn integer(&self) -> Option<i64> {
        match self {
            Value::Integer(value) => Some(*value),
            Value::Double(value) => integral(*value),
            Value::Boolean(_) => None,
            Value::Text(text) => parse_integer(text),
        }
    }

    /// Returns the value as true or false.
    pub fn flag(&self) -> Option<bool> {
        match self {
            Value::Boolean(value) => Some(*value),
            Value::Text(text) => parse_boolean(text),
            Value::Integer(_) | Value::Double(_) => None,
        }
    }
}

impl From<expr::Value> for Value<'_> {
    fn from(value: expr::Value) -> Self {
        match value {
            expr::Value::Integer(value) => Value::Integer(value),
            expr::Value::Double(value) => Value::Double(value),
            expr::Value::Boolean(value) => Value::Boolean(value),
        }
    }
}

/// Returns the integer that equals the double, if there is one.
pub(crate) fn integral(value: f64) -> Option<i64> {
    // Beyond 2^53 every double is whole because it lacks digits. The cast saturates there.
    (value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0).then_some(value as i64)
}

fn write_double(value: f64) -> String {
    if value.is_infinite() {
        return if value > 0.0 { "INF" } else { "-INF" }.to_owned();
    }
    if value.is_finite() {
        value.to_string()
    } else {
        "NaN".to_owned()
    }
}

/// Parses a double in the notation of XML Schema. White space around it is ignored.
pub fn parse_double(text: &str) -> Option<f64> {
    match trim(text) {
        "INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        text => {
            // Rust also parses `inf`, `infinity` and `nan`, in any case.
            let plain = |byte: u8| byte.is_ascii_digit() || b"+-.eE".contains(&byte);
            text.bytes().all(plain).then(|| text.parse().ok()).flatten()
        }
    }
}

/// Parses an integer in the notation of XML Schema. White space around it is ignored.
pub(crate) fn parse_integer(text: &str) -> Option<i64> {
    trim(text).parse().ok()
}

/// Parses a boolean in the notation of XML Schema. White space around it is ignored.
pub(crate) fn parse_boolean(text: &str) -> Option<bool> {
    match trim(text) {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_match_schema_data_types() {
        for (data_type, good, bad) in [
            (
                DataType::Double,
                &[" 1e-3 ", "+1", ".5", "5.", "INF", "-INF", "NaN"][..],
                &["", "inf", "1,5", "0x1", "5f", "--1", "$a"][..],
            ),
            (
                DataType::Int,
                &["-2147483648", " +7 "],
                &["2147483648", "1.0", ""],
            ),
            (DataType::UnsignedShort, &["0", "65535"], &["-1", "65536"]),
            (
                DataType::Boolean,
                &["true", "0", " 1 "],
                &["True", "yes", ""],
            ),
            (
                DataType::DateTime,
                &["2026-01-31T18:30:00Z"],
                &["2026-01-31"],
            ),
            (DataType::String, &["", "any"], &[]),
        ] {
            for text in good {
                assert!(data_type.parse(text).is_some(), "{data_type:?} {text}");
            }
            for text in bad {
                assert!(data_type.parse(text).is_none(), "{data_type:?} {text}");
            }
        }
    }
}
