//! Simple types: check whether a text is a value, and describe the valid values.

mod accept;
mod builtin;
mod describe;
mod number;

pub(crate) use accept::same_value;
pub use builtin::{Builtin, Order};
pub(crate) use describe::EXPRESSION;
pub use describe::Expectation;
pub(crate) use number::{Digits, float_value, is_decimal, is_float, is_integer};

use crate::pattern::Pattern;

/// White space of XML.
pub(crate) const XML_SPACE: [char; 4] = [' ', '\t', '\n', '\r'];

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
}
