//! Assertions and alternatives of XML Schema 1.1: the XPath 2.0 forms that schemas of this field
//! use, as a small tree.
//!
//! Understood: `and`, `or`, `not(…)`, `exists(…)`, `if (…) then … else …`, `true()`, `false()`,
//! comparisons, `count(…)`, `count(distinct-values(…))`, literals, and paths of child and
//! descendant steps that may end in an attribute. Anything else is refused by the compiler.

mod evaluate;
mod lexer;
mod notation;
mod xpath;

pub(crate) use evaluate::Scope;

use crate::names::NameId;

/// A condition over one element.
#[derive(Clone, Debug, PartialEq)]
pub struct Assertion {
    pub(crate) root: Expr,
}

impl Assertion {
    /// Whether it asks for descendants at any depth.
    pub(crate) fn is_deep(&self) -> bool {
        self.root.is_deep()
    }
}

impl Expr {
    fn is_deep(&self) -> bool {
        match self {
            Expr::And(parts) | Expr::Or(parts) => parts.iter().any(Expr::is_deep),
            Expr::Not(inner) => inner.is_deep(),
            Expr::If(parts) => parts.iter().any(Expr::is_deep),
            Expr::Compare(_, sides) => sides.iter().any(Expr::is_deep),
            Expr::Count(path) | Expr::CountDistinct(path) | Expr::Path(path) => {
                path.steps.iter().any(|step| step.deep)
            }
            Expr::Number(_) | Expr::Text(_) | Expr::Bool(_) => false,
        }
    }
}

/// Why an XPath expression is not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("understand the XPath `{text}`: {what}")]
pub struct XPathProblem {
    /// The expression.
    pub text: String,
    /// What is not understood.
    pub what: String,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    And(Vec<Expr>),
    Or(Vec<Expr>),
    Not(Box<Expr>),
    If(Box<[Expr; 3]>),
    Compare(Relation, Box<[Expr; 2]>),
    Count(Path),
    CountDistinct(Path),
    Path(Path),
    Number(f64),
    Text(Box<str>),
    Bool(bool),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Relation {
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

impl Relation {
    pub(crate) const ALL: [(Relation, &'static str, &'static str); 6] = [
        (Relation::Equal, "=", "eq"),
        (Relation::NotEqual, "!=", "ne"),
        (Relation::Less, "<", "lt"),
        (Relation::LessOrEqual, "<=", "le"),
        (Relation::Greater, ">", "gt"),
        (Relation::GreaterOrEqual, ">=", "ge"),
    ];

    pub(crate) fn symbol(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(relation, ..)| *relation == self)
            .map_or("=", |(_, symbol, _)| symbol)
    }
}

/// Steps from the element; the last may be an attribute.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Path {
    pub(crate) steps: Vec<PathStep>,
    pub(crate) attribute: Option<NameId>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PathStep {
    /// Whether it reaches all descendants (`//`) or children only.
    pub(crate) deep: bool,
    /// The name it selects.
    pub(crate) name: NameId,
}

/// How deep expressions may nest.
pub(crate) const MAX_DEPTH: usize = 48;
