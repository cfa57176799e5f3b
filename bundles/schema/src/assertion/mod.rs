//! Assertions and alternatives of XML Schema 1.1: the XPath 2.0 forms that the schemas of OpenDRIVE
//! and OpenSCENARIO use, as a small tree.
//!
//! Supported: `and`, `or`, `not(…)`, `exists(…)`, `if (…) then … else …`, `true()`, `false()`,
//! comparisons, `count(…)`, `count(distinct-values(…))`, literals, and paths of child and
//! descendant steps that may end in an attribute. The compiler rejects everything else.

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
    /// Checks whether the assertion refers to descendants at any depth.
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

/// Reason why an XPath expression is not supported.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("parse the XPath `{text}`: {what}")]
pub struct XPathProblem {
    /// The expression.
    pub text: String,
    /// Description of the unsupported part.
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

/// Steps from the element. The last one may be an attribute.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Path {
    pub(crate) steps: Vec<PathStep>,
    pub(crate) attribute: Option<NameId>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PathStep {
    /// Whether the step selects all descendants (`//`) or only children.
    pub(crate) deep: bool,
    /// Name of the selected elements.
    pub(crate) name: NameId,
}

/// Maximum nesting depth of expressions.
pub(crate) const MAX_DEPTH: usize = 48;
