//! The expression language of OpenSCENARIO XML: `speed="${2 * $limit / 3.6}"`.
//!
//! ```text
//! attribute := '${' or '}'                     -- the whole value; XML blanks around and between
//! or        := and     ('or'  and)*
//! and       := not     ('and' not)*
//! not       := 'not' not | sum
//! sum       := product (('+' | '-') product)*
//! product   := unary   (('*' | '/' | '%') unary)*
//! unary     := '-' unary | primary
//! primary   := number | 'true' | 'false' | 'pi' [1.4] | '$' name | call | '(' or ')'
//! call      := fn1 '(' or ')' | fn2 '(' or ',' or ')'
//! fn1       := round floor ceil sqrt  sin cos tan asin acos atan sign abs [1.3]
//! fn2       := pow                    max min [1.3]
//! number    := int ('.' [0-9]+)? ([eE] [+-]? int)?
//! int       := '0' | [1-9] [0-9]*
//! name      := [A-Za-z_] [A-Za-z0-9_]*
//! ```
//!
//! Words and names are case-sensitive. There are no comparisons, no texts and no powers with `^`.
//!
//! * A number without fraction and exponent is an integer of 64 bits, any other a double.
//! * `+ - * %`, `max`, `min`, `abs` and the unary minus keep integers; with one double they give a
//!   double. `/`, `sqrt`, `pow` and the trigonometric functions, in radians, always give a double.
//!   `round` (halves away from zero), `floor`, `ceil` and `sign` give an integer.
//! * `%` is the remainder with the sign of its left operand, as in C; not a modulo.
//! * `not`, `and`, `or` take booleans, everything else takes numbers; nothing converts between them.
//!
//! An expression has one [`Fault`] at most, the gravest: what cannot be read, before names that do
//! not exist, before types that do not fit, before values that cannot be computed.
//!
//! The way of an expression: `lexer` → `parser` → `tree` → `evaluate`. The operators and functions
//! are a table, `words`; what they do with numbers is `arithmetic`.

mod arithmetic;
mod evaluate;
mod lexer;
mod parser;
mod tree;
mod words;

use std::fmt;

/// Length in bytes beyond which an expression is not read.
pub const MAX_LENGTH: usize = 16 * 1024;

/// Depth of brackets, calls and signs beyond which an expression is not read.
pub const MAX_DEPTH: usize = 64;

/// What every expression begins with.
const OPENING: &str = "${";

/// A version of OpenSCENARIO, major and minor.
type Version = (u16, u16);

/// A value of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A whole number: any of the integer types.
    Integer(i64),
    /// A number with a fraction. As a result it is finite.
    Double(f64),
    /// A truth value.
    Boolean(bool),
}

/// What a name stands for where the expression is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operand {
    /// A parameter with this value.
    Value(Value),
    /// A parameter that cannot be computed with, and its type as messages name it: `string`,
    /// `dateTime`.
    Text(&'static str),
    /// A parameter whose declaration is faulty, which is said there.
    Unresolved,
    /// Nothing has this name.
    Undeclared,
    /// No parameter, but a variable has this name.
    Variable,
}

/// An expression's value and what is notable about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// The value.
    pub value: Value,
    /// Whether it depends on a parameter, so that it may differ where others are given.
    pub uses_parameters: bool,
    /// Functions and constants that came with a later version than the file's, each where it is
    /// first used.
    pub newer: Vec<Newer>,
    /// The first place where a digit that was written or computed is lost.
    pub imprecise: Option<Imprecision>,
}

/// A function, or `pi`, that is used in a file of an earlier version than the one it came with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Newer {
    /// Its name.
    pub name: &'static str,
    /// The version it came with, major and minor.
    pub since: (u16, u16),
    /// Where it is used: byte offset into the text.
    pub at: usize,
}

/// An integer that no double represents is used as one, or numbers other than zero give zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imprecision {
    /// Where: byte offset into the text.
    pub at: usize,
    /// What is lost: a part of a sentence.
    pub text: String,
}

/// Why an expression has no value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The kind, which decides the rule that reports it.
    pub kind: FaultKind,
    /// Where: byte offset into the text, at most its length.
    pub at: usize,
    /// What was found and what is allowed: a part of a sentence.
    pub text: String,
}

/// The kinds of [`Fault`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FaultKind {
    /// An operator, function, constant or character that the language does not have, or a number with
    /// letters in it.
    Operator,
    /// A function without brackets or with another number of arguments than it takes.
    Arguments,
    /// Boolean operators on numbers, or arithmetic on booleans.
    Types,
    /// Not written by the grammar, a text among the operands, or without a finite value.
    Evaluation,
    /// No parameter has this name.
    Undeclared(String),
    /// This is the name of a variable, which expressions cannot read.
    Variable(String),
    /// It rests on a parameter whose declaration is faulty, which is said there.
    Unresolved,
    /// It is longer than [`MAX_LENGTH`] or nested deeper than [`MAX_DEPTH`].
    Limit,
}

/// Evaluates an attribute's whole `text`, from `${` to `}`, in a file of this `version` (major and
/// minor), where `lookup` knows the parameters. Version 1.0 had no expressions and is read as 1.1.
///
/// # Errors
///
/// The gravest fault of the expression; among equals the first.
pub fn evaluate(
    text: &str,
    version: (u16, u16),
    lookup: &dyn Fn(&str) -> Operand,
) -> Result<Evaluated, Fault> {
    let version = version.max((1, 1));
    let tree = parser::parse(text)?;
    evaluate::evaluate(&tree, version, lookup)
}

/// The names behind `$` in an expression, repetitions included, each with the byte offset of its
/// `$`; of a faulty expression, too. Empty when `text` is no expression.
pub fn names(text: &str) -> Vec<(&str, usize)> {
    if !is_expression(text) {
        return Vec::new();
    }
    let dollars = text.match_indices('$');
    let named = |(at, _)| Some((lexer::name(text.get(at + 1..)?)?, at));
    dollars.filter_map(named).collect()
}

/// Whether `text` is meant as an expression: it begins with `${`, XML blanks aside.
pub fn is_expression(text: &str) -> bool {
    text.trim_start_matches(is_blank).starts_with(OPENING)
}

/// Whether the schemas from 1.1 on admit `text` as an expression, by its characters only.
pub(crate) fn is_of_schema(text: &str) -> bool {
    let inner = text
        .strip_prefix(OPENING)
        .and_then(|text| text.strip_suffix('}'));
    let admitted = |c: char| c.is_ascii_alphanumeric() || " _+-*/%$().,".contains(c);
    inner.is_some_and(|inner| inner.chars().all(admitted))
}

/// XML's white space.
fn is_blank(c: char) -> bool {
    matches!(c, ' ' | '\t' | '\r' | '\n')
}

/// `code` as messages quote it: in backticks, on one line, and not longer than a line.
fn quoted(code: &str) -> String {
    const LONGEST: usize = 40;
    let mut shown: String = code.chars().take(LONGEST).collect();
    if shown.len() < code.len() {
        shown.push('…');
    }
    format!("`{}`", shown.replace(char::is_control, " "))
}

impl Fault {
    fn new(kind: FaultKind, at: usize, text: impl Into<String>) -> Fault {
        Fault {
            kind,
            at,
            text: text.into(),
        }
    }

    fn evaluation(at: usize, text: impl Into<String>) -> Fault {
        Fault::new(FaultKind::Evaluation, at, text)
    }

    /// The graver of two faults; of equals the first.
    fn or_graver(self, other: Fault) -> Fault {
        if other.kind.rank() < self.kind.rank() {
            other
        } else {
            self
        }
    }
}

impl FaultKind {
    /// The gravest is 0: it hides the others, most of which would follow from it.
    fn rank(&self) -> u8 {
        match self {
            FaultKind::Limit | FaultKind::Operator | FaultKind::Arguments => 0,
            FaultKind::Undeclared(_) | FaultKind::Variable(_) => 1,
            FaultKind::Types => 2,
            FaultKind::Evaluation => 3,
            FaultKind::Unresolved => 4,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Fault {}
