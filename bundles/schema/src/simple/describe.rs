//! Description of the values that a simple type accepts.

use super::{Bound, Builtin, Facets, SimpleType, Variety};
use crate::model::Schema;

/// Description of the valid values as data.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Expectation {
    /// The allowed values, if they can be listed.
    pub values: Vec<String>,
    /// Other allowed values as text, e.g. `a number of at least 0`.
    pub words: Vec<String>,
}

/// Words for any number.
const NUMBER: &str = "a number";
/// Words for an integer, or their beginning.
const WHOLE: &str = "a whole number";

impl Expectation {
    /// Checks whether a number is expected.
    pub fn is_number(&self) -> bool {
        let is_number = |words: &String| words.starts_with(NUMBER) || words.starts_with(WHOLE);
        self.words.iter().any(is_number)
    }

    /// Returns both as one part of a sentence. Long lists of values are cut. Parameters and
    /// expressions come last.
    pub fn sentence(&self) -> String {
        const SHOWN: usize = 12;
        let mut parts = self.words.clone();
        parts.sort_by_key(|words| words.starts_with(PARAMETER) || words.starts_with(EXPRESSION));
        if !self.values.is_empty() {
            let list: Vec<String> = self
                .values
                .iter()
                .take(SHOWN)
                .map(|value| format!("\"{value}\""))
                .collect();
            let one_of = if self.values.len() == 1 {
                ""
            } else {
                "one of "
            };
            let more = match self.values.len().saturating_sub(SHOWN) {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            parts.insert(0, format!("{one_of}{}{more}", list.join(", ")));
        }
        match parts.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{}, or {last}", rest.join(", ")),
            _ => parts.concat(),
        }
    }
}

/// First words of the text for a parameter of OpenSCENARIO.
const PARAMETER: &str = "a parameter";
/// First words of the text for an expression.
pub(crate) const EXPRESSION: &str = "an expression";

/// Patterns of country codes. They are described by their number of letters.
const LETTERS_2: &str = "[A-Z]{2}";
const LETTERS_3: &str = "[A-Z]{3}";

impl SimpleType {
    /// Describes the values of this type.
    pub fn expectation(&self, schema: &Schema) -> Expectation {
        let mut all = Expectation::default();
        self.collect(schema, &mut all);
        all
    }

    fn collect(&self, schema: &Schema, all: &mut Expectation) {
        if let Some(values) = &self.facets.enumeration {
            for value in values {
                if !all.values.iter().any(|have| **have == **value) {
                    all.values.push(value.to_string());
                }
            }
            return;
        }
        let words = match &self.variety {
            Variety::Union(members) => {
                let members = members
                    .iter()
                    .filter_map(|&id| schema.simple.get(id as usize));
                members.for_each(|member| member.collect(schema, all));
                return;
            }
            Variety::List(item) => {
                let item = schema
                    .simple
                    .get(*item as usize)
                    .map(|item| item.expectation(schema).sentence());
                format!(
                    "a list, separated by spaces, of: {}",
                    item.unwrap_or_default()
                )
            }
            Variety::Atomic(builtin) => self.facets.words(self.name.as_deref(), *builtin),
        };
        if !all.words.contains(&words) {
            all.words.push(words);
        }
    }
}

impl Facets {
    fn words(&self, name: Option<&str>, builtin: Builtin) -> String {
        let mut words = match (name, self.patterns.is_empty()) {
            // The names of OpenSCENARIO's patterns `parameter` and `expression` are already clear.
            (Some("parameter"), false) => return format!("{PARAMETER} ($name)"),
            (Some("expression"), false) => return format!("{EXPRESSION} (${{…}})"),
            _ => noun(builtin).to_owned(),
        };
        words += &range(self.lowest.as_ref(), self.highest.as_ref());
        for pattern in &self.patterns {
            match pattern.source() {
                LETTERS_2 => words += " of two capital letters",
                LETTERS_3 => words += " of three capital letters",
                source => words += &format!(" of the form {source}"),
            }
        }
        match (self.min_length, self.max_length) {
            (None, None) => {}
            (Some(least), Some(most)) if least == most => words += &format!(" of length {least}"),
            (least, most) => {
                let most = most.map_or(String::new(), |most| format!(" to {most}"));
                words += &format!(" of length {}{most}", least.unwrap_or(0));
            }
        }
        if let Some(name) = standard_name(builtin) {
            words += &format!(" ({name})");
        }
        words
    }
}

fn range(lowest: Option<&Bound>, highest: Option<&Bound>) -> String {
    let low = lowest.map(|bound| {
        let word = if bound.exclusive {
            "greater than"
        } else {
            "of at least"
        };
        format!(" {word} {}", bound.text)
    });
    let high = highest.map(|bound| {
        let word = if bound.exclusive {
            "less than"
        } else {
            "at most"
        };
        format!(" {word} {}", bound.text)
    });
    match (low, high) {
        (Some(low), Some(high)) => format!("{low} and{high}"),
        (low, high) => low.or(high).unwrap_or_default(),
    }
}

/// Returns the name used in the standards for types that authors know by name.
fn standard_name(builtin: Builtin) -> Option<&'static str> {
    Some(match builtin {
        Builtin::Boolean => "boolean",
        Builtin::Float => "float",
        Builtin::Double => "double",
        Builtin::Integer => "integer",
        Builtin::Int => "int",
        Builtin::UnsignedInt => "unsignedInt",
        Builtin::UnsignedShort => "unsignedShort",
        Builtin::DateTime => "dateTime",
        _ => return None,
    })
}

fn noun(builtin: Builtin) -> &'static str {
    match builtin {
        Builtin::AnySimple | Builtin::String | Builtin::NormalizedString | Builtin::Token => {
            "a text"
        }
        Builtin::Boolean => "true or false",
        Builtin::Decimal => "a decimal number without an exponent",
        Builtin::Float | Builtin::Double => NUMBER,
        Builtin::Integer => WHOLE,
        Builtin::NonNegative => "a whole number of at least 0",
        Builtin::Positive => "a whole number of at least 1",
        Builtin::NonPositive => "a whole number of at most 0",
        Builtin::Negative => "a whole number of at most -1",
        Builtin::Long => "a 64-bit whole number",
        Builtin::Int => "a whole number from -2147483648 to 2147483647",
        Builtin::Short => "a whole number from -32768 to 32767",
        Builtin::Byte => "a whole number from -128 to 127",
        Builtin::UnsignedLong => "a whole number from 0 to 18446744073709551615",
        Builtin::UnsignedInt => "a whole number from 0 to 4294967295",
        Builtin::UnsignedShort => "a whole number from 0 to 65535",
        Builtin::UnsignedByte => "a whole number from 0 to 255",
        Builtin::DateTime => "a date and time such as 2024-05-31T12:00:00",
        Builtin::Date => "a date such as 2024-05-31",
        Builtin::Time => "a time such as 12:00:00",
        Builtin::Language => "a language code such as en-GB",
        Builtin::NmToken | Builtin::Name | Builtin::NcName => "an XML name",
        Builtin::AnyUri => "a URI",
        Builtin::HexBinary => "hexadecimal digits in pairs",
        Builtin::Base64 => "base64 text",
    }
}
