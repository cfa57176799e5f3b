//! What can be wrong with a value that is not written out.

use qcbus_document::Attribute;

use crate::data_type::Value;

/// A value of the document that cannot be had as it is written, or only against the standard.
#[derive(Debug, Clone)]
pub struct ValueFault<'d> {
    /// The attribute.
    pub attribute: Attribute<'d>,
    /// What is wrong.
    pub kind: ValueFaultKind,
    /// The offending part, in bytes from the start of the value.
    pub at: usize,
    /// The parameter in question; empty when the fault is about none.
    pub name: String,
    /// What was found and what is allowed: a sentence fragment without the attribute's name.
    pub text: String,
    /// Whether the schema's checker says it as well: what is written is no value of the attribute's
    /// type, whatever the parameters are.
    pub said_by_schema: bool,
}

/// What is wrong with a value. Each kind is one rule's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ValueFaultKind {
    /// No parameter of this name is declared around the element.
    Undeclared,
    /// No parameter, but a variable has this name.
    Variable,
    /// A declaration uses a parameter that is declared after it, or itself.
    Order,
    /// An expression has an operator, a function or a constant that the language does not have.
    Operator,
    /// A function has too few or too many arguments.
    Arguments,
    /// Numbers and booleans are mixed up.
    Types,
    /// An expression has no value: a division by zero, a bracket too many.
    Evaluation,
    /// An expression is longer or deeper than what is evaluated.
    Limit,
    /// The result of an expression does not fit its attribute.
    Result,
    /// The result of an expression has no fraction, but its type is double where an integer is due.
    Narrowed,
    /// The value of a parameter does not fit the attribute that it is used for.
    Parameter,
    /// The value of a parameter is none of the words that the attribute may have.
    Word,
    /// A declared value is no literal of the declared type.
    Declared,
    /// An expression where the attribute takes none: text, date-time, words.
    InText,
    /// A parameter within a longer text, which the standard does not replace.
    Embedded,
    /// A substitution that one simulator knows and the standard does not.
    Dialect(Dialect),
}

/// Substitutions beyond the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// `$(find-pkg-share …)`, `$(var …)`: of ROS launch files.
    Ros,
}

impl Dialect {
    /// What messages call it.
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
    /// What the value is nevertheless, where the fault leaves no doubt about it.
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
