//! Words and signs of the language.

use super::Version;
use super::arithmetic::{self as numbers, OfOne, OfTwo};

/// An operator between two operands.
pub(super) struct Operator {
    pub symbol: &'static str,
    pub action: Action,
}

/// Computation of an operator.
#[derive(Clone, Copy)]
pub(super) enum Action {
    Numbers(OfTwo),
    Booleans(fn(bool, bool) -> bool),
}

/// A function.
pub(super) struct Function {
    pub name: &'static str,
    /// Version that introduced it.
    pub since: Version,
    pub form: Form,
}

/// Number of arguments of a function, and its computation.
#[derive(Clone, Copy)]
pub(super) enum Form {
    One(OfOne),
    Two(OfTwo),
}

/// Operators with the lowest precedence.
pub(super) static OR: [Operator; 1] = [Operator::booleans("or", |a, b| a || b)];

pub(super) static AND: [Operator; 1] = [Operator::booleans("and", |a, b| a && b)];

pub(super) static SUM: [Operator; 2] = [
    Operator::numbers("+", numbers::add),
    Operator::numbers("-", numbers::subtract),
];

/// Operators with the highest precedence.
pub(super) static PRODUCT: [Operator; 3] = [
    Operator::numbers("*", numbers::multiply),
    Operator::numbers("/", numbers::divide),
    Operator::numbers("%", numbers::remainder),
];

/// The functions. Simulators accept those of version 1.3 from 1.1 on.
pub(super) static FUNCTIONS: [Function; 15] = {
    use Form::{One, Two};
    [
        Function::new("round", (1, 1), One(numbers::round)),
        Function::new("floor", (1, 1), One(numbers::floor)),
        Function::new("ceil", (1, 1), One(numbers::ceil)),
        Function::new("sqrt", (1, 1), One(numbers::sqrt)),
        Function::new("pow", (1, 1), Two(numbers::pow)),
        Function::new("sin", (1, 3), One(numbers::sin)),
        Function::new("cos", (1, 3), One(numbers::cos)),
        Function::new("tan", (1, 3), One(numbers::tan)),
        Function::new("asin", (1, 3), One(numbers::asin)),
        Function::new("acos", (1, 3), One(numbers::acos)),
        Function::new("atan", (1, 3), One(numbers::atan)),
        Function::new("sign", (1, 3), One(numbers::sign)),
        Function::new("abs", (1, 3), One(numbers::abs)),
        Function::new("max", (1, 3), Two(numbers::max)),
        Function::new("min", (1, 3), Two(numbers::min)),
    ]
};

/// Version that introduced `pi`. Simulators accepted it earlier.
pub(super) const PI_SINCE: Version = (1, 4);

/// Words that are neither functions nor preceded by `$`.
const RESERVED: [&str; 6] = ["not", "and", "or", "true", "false", "pi"];

/// Checks whether the language has this word.
pub(super) fn is_known(word: &str) -> bool {
    RESERVED.contains(&word) || Function::named(word).is_some()
}

/// Returns the word of the language that equals `word` if case is ignored.
pub(super) fn ignoring_case(word: &str) -> Option<&'static str> {
    let functions = FUNCTIONS.iter().map(|function| function.name);
    let mut words = functions.chain(RESERVED);
    words.find(|known| known.eq_ignore_ascii_case(word))
}

/// Notations of other languages that this one does not have, each with the alternative. The longer
/// ones come before the shorter ones.
pub(super) static FOREIGN: [(&str, &str); 28] = [
    ("**", POWER),
    ("^", POWER),
    ("//", "write a whole quotient as `floor(7 / 2)`"),
    ("&&", "write `and`"),
    ("&", "write `and`"),
    ("||", "write `or`"),
    ("|", "write `or`"),
    ("==", COMPARISON),
    ("!=", COMPARISON),
    ("<=", COMPARISON),
    (">=", COMPARISON),
    ("<", COMPARISON),
    (">", COMPARISON),
    ("=", "values cannot be compared or assigned here"),
    ("!", "write `not`"),
    ("?", "a choice between values is not supported"),
    ("'", TEXT),
    ("\"", TEXT),
    ("{", BRACKETS),
    ("[", BRACKETS),
    ("]", BRACKETS),
    ("\u{d7}", "write a product as `2 * 3`"),
    ("\u{b7}", "write a product as `2 * 3`"),
    ("\u{f7}", "write a quotient as `7 / 2`"),
    ("\u{2212}", HYPHEN),
    ("\u{2013}", HYPHEN),
    ("\u{3c0}", "write `pi` (since version 1.4)"),
    ("\u{221a}", "write a square root as `sqrt(2)`"),
];

const POWER: &str = "write a power as `pow(2, 3)`";
const COMPARISON: &str = "compare values only in conditions";
const TEXT: &str = "expressions support numbers and booleans, but no text";
const BRACKETS: &str = "use round brackets only";
const HYPHEN: &str = "write a minus as the hyphen of the keyboard, `-`";

impl Operator {
    const fn numbers(symbol: &'static str, action: OfTwo) -> Operator {
        let action = Action::Numbers(action);
        Operator { symbol, action }
    }

    const fn booleans(symbol: &'static str, action: fn(bool, bool) -> bool) -> Operator {
        let action = Action::Booleans(action);
        Operator { symbol, action }
    }
}

impl Function {
    const fn new(name: &'static str, since: Version, form: Form) -> Function {
        Function { name, since, form }
    }

    /// Returns the function of this name.
    pub fn named(name: &str) -> Option<&'static Function> {
        FUNCTIONS.iter().find(|function| function.name == name)
    }

    /// Returns the expected arguments for messages.
    pub fn takes(&self) -> String {
        let name = self.name;
        match self.form {
            Form::One(_) => format!("`{name}` takes one argument, `{name}(x)`"),
            Form::Two(_) => format!("`{name}` takes two arguments, `{name}(x, y)`"),
        }
    }
}
