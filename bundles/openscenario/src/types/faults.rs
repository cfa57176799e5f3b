//! Faults of values that are not literals.

use qcbus_document::Attribute;

use crate::types::data_type::Value;

/// A value of the document that cannot be resolved as written, or only against the standard.
#[derive(Debug, Clone)]
pub struct ValueFault<'d> {
    /// The attribute.
    pub attribute: Attribute<'d>,
    /// Kind of the fault.
    pub kind: ValueFaultKind,
    /// Position of the offending part, in bytes from the start of the value.
    pub at: usize,
    /// Parameter that the fault is about. Empty if there is none.
    pub name: String,
    /// The found and the allowed value: a sentence fragment without the attribute's name.
    pub text: String,
    /// Whether the schema checker reports it too. This is so if the written text can never be a
    /// value of the attribute's type, whatever the parameters are.
    pub said_by_schema: bool,
}

/// Kind of a fault of a value. Each kind belongs to one rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ValueFaultKind {
    /// No parameter of this name is declared around the element.
    Undeclared,
    /// A variable, not a parameter, has this name.
    Variable,
    /// A declaration uses a parameter that is declared after it, or itself.
    Order,
    /// An expression has an operator, a function or a constant that the language does not have.
    Operator,
    /// A function has too few or too many arguments.
    Arguments,
    /// Numbers and booleans are mixed up.
    Types,
    /// An expression has no value, for example because of a division by zero or an extra bracket.
    Evaluation,
    /// An expression is too long or too deep to be evaluated.
    Limit,
    /// The result of an expression does not fit its attribute.
    Result,
    /// The result of an expression has no fraction, but its type is double and the attribute
    /// requires an integer.
    Narrowed,
    /// The value of a parameter does not fit an attribute that uses it.
    Parameter,
    /// The value of a parameter is not one of the words that the attribute allows.
    Word,
    /// A declared value is not a literal of the declared type.
    Declared,
    /// An attribute has an expression but does not allow one: text, date-time, words.
    InText,
    /// A parameter is inside a longer text, where the standard does not replace it.
    Embedded,
    /// A substitution that one simulator supports and the standard does not define.
    Dialect(Dialect),
}

/// Substitutions beyond the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// `$(find-pkg-share …)`, `$(var …)`: from ROS launch files.
    Ros,
}

impl Dialect {
    /// Returns its name for messages.
    pub fn name(self) -> &'static str {
        match self {
            Dialect::Ros => "a substitution of ROS launch files",
        }
    }
}

/// A fault whose attribute is not known yet.
#[derive(Debug, Clone)]
pub(crate) struct Problem<'d> {
    pub(crate) kind: ValueFaultKind,
    pub(crate) at: usize,
    pub(crate) name: String,
    pub(crate) text: String,
    /// The value in spite of the fault, where it is still unambiguous.
    pub(crate) value: Option<Value<'d>>,
}

impl Problem<'_> {
    pub(crate) fn new(kind: ValueFaultKind, at: usize, text: impl Into<String>) -> Self {
        Problem {
            kind,
            at,
            name: String::new(),
            text: text.into(),
            value: None,
        }
    }
}
