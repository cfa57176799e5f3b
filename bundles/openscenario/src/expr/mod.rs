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
//! * A number without fraction and exponent is an integer of 64 bits. Any other number is a double.
//! * `+ - * %`, `max`, `min`, `abs` and the unary minus keep integers. With one double they return
//!   a double. `/`, `sqrt`, `pow` and the trigonometric functions (in radians) always return a
//!   double. `round` (halves away from zero), `floor`, `ceil` and `sign` return an integer.
//! * `%` is the remainder with the sign of its left operand, as in C. It is not a modulo.
//! * `not`, `and`, `or` take booleans, everything else takes numbers. There is no conversion
//!   between them.
//!
//! An expression has at most one [`Fault`], the gravest. The order is: text that cannot be read,
//! names that do not exist, types that do not fit, values that cannot be computed.
//!
//! An expression passes through `lexer` → `parser` → `tree` → `evaluate`. The operators and
//! functions are a table, `words`. Their arithmetic is in `arithmetic`.

mod arithmetic;
mod evaluate;
mod lexer;
mod parser;
mod tree;
mod words;

use std::fmt;

/// Maximum length of an expression in bytes. A longer one is not read.
pub const MAX_LENGTH: usize = 16 * 1024;

/// Maximum depth of brackets, calls and signs. A deeper expression is not read.
pub const MAX_DEPTH: usize = 64;

/// Opening of every expression.
const OPENING: &str = "${";

/// A version of OpenSCENARIO, major and minor.
type Version = (u16, u16);

/// A value of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A whole number: any of the integer types.
    Integer(i64),
    /// A double. It is finite if it is a result.
    Double(f64),
    /// A truth value.
    Boolean(bool),
}

/// Meaning of a name at the place of the expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operand {
    /// A parameter with this value.
    Value(Value),
    /// A parameter that is not usable in computations. The text is its type as messages name it:
    /// `string`, `dateTime`.
    Text(&'static str),
    /// A parameter with a faulty declaration. The fault is reported at the declaration.
    Unresolved,
    /// No parameter or variable has this name.
    Undeclared,
    /// A variable, not a parameter, has this name.
    Variable,
}

/// An expression's value and remarks about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// The value.
    pub value: Value,
    /// Whether it depends on a parameter. Its value may then differ with other parameters.
    pub uses_parameters: bool,
    /// Functions and constants that are newer than the file's version, each at its first use.
    pub newer: Vec<Newer>,
    /// First position where precision of a written or computed number is lost.
    pub imprecise: Option<Imprecision>,
}

/// A function, or `pi`, that is newer than the version of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Newer {
    /// Its name.
    pub name: &'static str,
    /// Version that introduced it, major and minor.
    pub since: (u16, u16),
    /// Position of its use: byte offset into the text.
    pub at: usize,
}

/// Loss of precision. An integer without an exact double is used as a double, or non-zero numbers
/// give zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imprecision {
    /// Position: byte offset into the text.
    pub at: usize,
    /// Description of the loss: a part of a sentence.
    pub text: String,
}

/// Reason why an expression has no value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Kind of the fault. It decides which rule reports it.
    pub kind: FaultKind,
    /// Position: byte offset into the text, at most its length.
    pub at: usize,
    /// The found and the allowed text: a part of a sentence.
    pub text: String,
}

/// The kinds of [`Fault`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FaultKind {
    /// An operator, function, constant or character that the language does not have, or a number
    /// with letters in it.
    Operator,
    /// A function without brackets or with a wrong number of arguments.
    Arguments,
    /// Boolean operators on numbers, or arithmetic on booleans.
    Types,
    /// The expression violates the grammar, has a text among its operands, or has no finite value.
    Evaluation,
    /// No parameter has this name.
    Undeclared(String),
    /// A variable has this name. Expressions cannot read variables.
    Variable(String),
    /// The value depends on a parameter with a faulty declaration. The fault is reported at the
    /// declaration.
    Unresolved,
    /// The expression is longer than [`MAX_LENGTH`] or nested deeper than [`MAX_DEPTH`].
    Limit,
}

/// Evaluates an attribute's whole `text`, from `${` to `}`, in a file of this `version` (major and
/// minor). `lookup` resolves the parameters. Version 1.0 had no expressions and is read as 1.1.
///
/// # Errors
///
/// Returns the gravest fault of the expression. Among equal faults it is the first.
pub fn evaluate(
    text: &str,
    version: (u16, u16),
    lookup: &dyn Fn(&str) -> Operand,
) -> Result<Evaluated, Fault> {
    let version = version.max((1, 1));
    let tree = parser::parse(text)?;
    evaluate::evaluate(&tree, version, lookup)
}

/// Returns the names after `$` in an expression, including repetitions and faulty expressions. Each
/// comes with the byte offset of its `$`. The list is empty if `text` is no expression.
pub fn names(text: &str) -> Vec<(&str, usize)> {
    if !is_expression(text) {
        return Vec::new();
    }
    let dollars = text.match_indices('$');
    let named = |(at, _)| Some((lexer::name(text.get(at + 1..)?)?, at));
    dollars.filter_map(named).collect()
}

/// Checks whether `text` is meant as an expression: it begins with `${` after optional XML blanks.
pub fn is_expression(text: &str) -> bool {
    text.trim_start_matches(is_blank).starts_with(OPENING)
}

/// Checks whether the schemas from 1.1 on admit `text` as an expression. They look at its
/// characters only.
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

/// Quotes `code` for messages: in backticks, on one line, and cut to a maximum length.
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

    /// Returns the graver of two faults. If both are equal, returns the first.
    fn or_graver(self, other: Fault) -> Fault {
        if other.kind.rank() < self.kind.rank() {
            other
        } else {
            self
        }
    }
}

impl FaultKind {
    /// Returns the rank. The gravest is 0. It hides the others, because most of them are its
    /// consequences.
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
