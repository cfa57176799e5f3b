//! Simple types: check whether a text is a value, and describe the valid values.

mod builtin;
mod describe;
mod number;
mod time;

use std::borrow::Cow;

pub use builtin::{Builtin, Order};
pub(crate) use builtin::{is_name_char, is_name_start};
pub(crate) use describe::EXPRESSION;
pub use describe::Expectation;
pub(crate) use number::{Digits, float_value, is_decimal, is_float, is_integer};

use crate::model::{Edition, Schema};
use crate::regex::Pattern;

/// A simple type with all its restrictions.
#[derive(Clone, Debug)]
pub struct SimpleType {
    /// Name of the type in the schema, if it has one.
    pub name: Option<Box<str>>,
    /// One value, several values, or one of several types.
    pub variety: Variety,
    /// Further restrictions.
    pub facets: Facets,
}

/// The shape of a simple type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Variety {
    /// One value of a built-in type.
    Atomic(Builtin),
    /// White-space-separated values of a type.
    List(u32),
    /// A value of any of these types.
    Union(Vec<u32>),
}

/// Restrictions of a simple type.
#[derive(Clone, Debug, Default)]
pub struct Facets {
    /// The allowed values as written in the schema, or `None` for no restriction.
    pub enumeration: Option<Vec<Box<str>>>,
    /// Patterns that must all match.
    pub patterns: Vec<Pattern>,
    /// Lower limit of the value.
    pub lowest: Option<Bound>,
    /// Upper limit of the value.
    pub highest: Option<Bound>,
    /// Minimum number of characters (or list items).
    pub min_length: Option<u32>,
    /// Maximum number of characters (or list items).
    pub max_length: Option<u32>,
    /// Maximum number of digits.
    pub total_digits: Option<u32>,
    /// Maximum number of digits after the point.
    pub fraction_digits: Option<u32>,
    /// Whether white space is dropped although the built-in type keeps it.
    pub collapse: bool,
}

/// One end of a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The end as written.
    pub text: Box<str>,
    /// The end as a number.
    pub value: f64,
    /// Whether the end itself is excluded.
    pub exclusive: bool,
}

impl SimpleType {
    /// Creates a built-in type without restrictions.
    pub(crate) fn builtin(builtin: Builtin) -> Self {
        Self {
            name: None,
            variety: Variety::Atomic(builtin),
            facets: Facets::default(),
        }
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        let values = self
            .facets
            .enumeration
            .iter()
            .flatten()
            .map(|value| value.len() + 16)
            .sum::<usize>();
        let patterns: usize = self.facets.patterns.iter().map(Pattern::heap_bytes).sum();
        size_of::<Self>() + values + patterns
    }

    /// Checks whether `text` is a value of this type. Unions nest at most as deep as in the schema.
    pub fn accepts(&self, text: &str, schema: &Schema) -> bool {
        match &self.variety {
            Variety::Atomic(builtin) => self.accepts_atomic(*builtin, text, schema.edition),
            Variety::Union(members) => {
                let fits = |&id: &u32| {
                    schema
                        .simple
                        .get(id as usize)
                        .is_some_and(|one| one.accepts(text, schema))
                };
                members.iter().any(fits) && self.facets.accept_text(text)
            }
            Variety::List(item) => self.accepts_list(*item, text, schema),
        }
    }

    fn accepts_atomic(&self, builtin: Builtin, text: &str, edition: Edition) -> bool {
        let text = self.normalized(builtin, text);
        builtin.accepts(&text, edition)
            && (self.facets.is_plain() || self.facets.accept(builtin, &text))
    }

    fn accepts_list(&self, item: u32, text: &str, schema: &Schema) -> bool {
        let Some(item) = schema.simple.get(item as usize) else {
            return false;
        };
        let mut count = 0u32;
        for part in text
            .split([' ', '\t', '\n', '\r'])
            .filter(|part| !part.is_empty())
        {
            count = count.saturating_add(1);
            if !item.accepts(part, schema) {
                return false;
            }
        }
        self.facets.accept_length(count) && self.facets.accept_text(text.trim_matches(XML_SPACE))
    }

    /// Returns the text with its white space normalized for the type. It is usually borrowed.
    pub(crate) fn normalized<'t>(&self, builtin: Builtin, text: &'t str) -> Cow<'t, str> {
        if !builtin.collapses() && !self.facets.collapse {
            return Cow::Borrowed(text);
        }
        let trimmed = trim(text);
        if builtin.order() != Order::Text || !has_inner_space(trimmed) {
            return Cow::Borrowed(trimmed);
        }
        let words: Vec<&str> = trimmed
            .split(XML_SPACE)
            .filter(|word| !word.is_empty())
            .collect();
        Cow::Owned(words.join(" "))
    }
}

/// Returns the text without white space around it. Usually a check of two bytes is enough.
fn trim(text: &str) -> &str {
    match text.as_bytes() {
        [first, .., last] if *first > b' ' && *last > b' ' => text,
        _ => text.trim_matches(XML_SPACE),
    }
}

/// Checks whether collapsing white space would change a trimmed text.
fn has_inner_space(text: &str) -> bool {
    let bytes = text.as_bytes();
    bytes
        .iter()
        .any(|byte| matches!(byte, b'\t' | b'\n' | b'\r'))
        || bytes
            .windows(2)
            .any(|pair| is_space(pair[0]) && is_space(pair[1]))
}

/// White space of XML.
pub(crate) const XML_SPACE: [char; 4] = [' ', '\t', '\n', '\r'];

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\n' | b'\r')
}

impl Facets {
    pub(crate) fn is_plain(&self) -> bool {
        self.enumeration.is_none()
            && self.patterns.is_empty()
            && self.lowest.is_none()
            && self.highest.is_none()
            && self.min_length.is_none()
            && self.max_length.is_none()
            && self.total_digits.is_none()
            && self.fraction_digits.is_none()
    }

    fn accept(&self, builtin: Builtin, text: &str) -> bool {
        self.accept_range(builtin, text)
            && self.enumeration.as_ref().is_none_or(|values| {
                values
                    .iter()
                    .any(|value| same_value(builtin.order(), value, text))
            })
            && self.patterns.iter().all(|pattern| pattern.matches(text))
            && self.accept_digits(text)
            && (self.no_length() || self.accept_length(length(builtin, text)))
    }

    /// Checks the facets that apply to the text of a whole union or list.
    fn accept_text(&self, text: &str) -> bool {
        let listed = |values: &Vec<Box<str>>| {
            values
                .iter()
                .any(|value| &**value == text.trim_matches(XML_SPACE))
        };
        self.enumeration.as_ref().is_none_or(listed)
            && self.patterns.iter().all(|pattern| pattern.matches(text))
    }

    fn accept_range(&self, builtin: Builtin, text: &str) -> bool {
        // Most ranges are `at least 0`, and these need only a check of the sign.
        let unsigned = matches!(builtin, Builtin::Float | Builtin::Double)
            && matches!(text.as_bytes().first(), Some(b'0'..=b'9' | b'.'));
        let above = |bound: &Bound| {
            if unsigned && bound.value <= 0.0 && !bound.exclusive {
                return true;
            }
            ordered(
                builtin,
                &bound.text,
                bound.value,
                text,
                bound.exclusive,
                true,
            )
        };
        let below = |bound: &Bound| {
            ordered(
                builtin,
                &bound.text,
                bound.value,
                text,
                bound.exclusive,
                false,
            )
        };
        self.lowest.as_ref().is_none_or(above) && self.highest.as_ref().is_none_or(below)
    }

    fn accept_digits(&self, text: &str) -> bool {
        if self.total_digits.is_none() && self.fraction_digits.is_none() {
            return true;
        }
        let digits = Digits::of(text);
        let fraction = digits.fraction.len();
        let total = digits.whole.len() + fraction;
        self.total_digits.is_none_or(|most| total <= most as usize)
            && self
                .fraction_digits
                .is_none_or(|most| fraction <= most as usize)
    }

    fn no_length(&self) -> bool {
        self.min_length.is_none() && self.max_length.is_none()
    }

    fn accept_length(&self, length: u32) -> bool {
        self.min_length.is_none_or(|least| length >= least)
            && self.max_length.is_none_or(|most| length <= most)
    }
}

fn length(builtin: Builtin, text: &str) -> u32 {
    let count = match builtin {
        Builtin::HexBinary => text.len() / 2,
        Builtin::Base64 => {
            text.bytes()
                .filter(|byte| !matches!(byte, b' ' | b'='))
                .count()
                * 3
                / 4
        }
        _ => text.chars().count(),
    };
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn ordered(
    builtin: Builtin,
    bound: &str,
    number: f64,
    text: &str,
    exclusive: bool,
    lower: bool,
) -> bool {
    let order = match builtin.order() {
        Order::Decimal => Some(Digits::of(text).cmp(&Digits::of(bound))),
        // NaN cannot be compared, so it is in no range.
        _ => float_value(text).and_then(|value| value.partial_cmp(&number)),
    };
    match order {
        None => false,
        Some(order) if order.is_eq() => !exclusive,
        Some(order) => order.is_gt() == lower,
    }
}

/// Checks whether two lexically correct texts represent the same value.
pub(crate) fn same_value(order: Order, left: &str, right: &str) -> bool {
    if left == right {
        return true;
    }
    match order {
        Order::Text => false,
        Order::Decimal => Digits::of(left) == Digits::of(right),
        Order::Float => float_value(left).is_some_and(|value| float_value(right) == Some(value)),
        Order::Boolean => truth(left) == truth(right),
    }
}

fn truth(text: &str) -> bool {
    matches!(text, "true" | "1")
}
