//! Checks whether texts are values of simple types.

use std::borrow::Cow;

use super::number::{Digits, float_value};
use super::{Bound, Builtin, Facets, Order, SimpleType, Variety, XML_SPACE};
use crate::edition::Edition;
use crate::model::Schema;

impl SimpleType {
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
            let is_clear = unsigned && bound.value <= 0.0 && !bound.exclusive;
            is_clear || ordered(builtin, bound, text, true)
        };
        let below = |bound: &Bound| ordered(builtin, bound, text, false);
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

fn ordered(builtin: Builtin, bound: &Bound, text: &str, lower: bool) -> bool {
    let order = match builtin.order() {
        Order::Decimal => Some(Digits::of(text).cmp(&Digits::of(&bound.text))),
        // NaN cannot be compared, so it is in no range.
        _ => float_value(text).and_then(|value| value.partial_cmp(&bound.value)),
    };
    match order {
        None => false,
        Some(order) if order.is_eq() => !bound.exclusive,
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
