//! Compares random expressions with an independent computation. A tree is generated, and an oracle
//! computes its value. Its text, with superfluous blanks and brackets, must have the same value.

use proptest::prelude::*;
use qcbus_openscenario::expr::{FaultKind, Operand, Value, evaluate};

fn parameter(name: &str) -> Operand {
    Operand::Value(match name {
        "zero" => Value::Double(0.0),
        "half" => Value::Double(0.5),
        "one" => Value::Integer(1),
        "smallest" => Value::Integer(i64::MIN),
        "yes" => Value::Boolean(true),
        _ => return Operand::Undeclared,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn expression_values_match_the_oracle(tree in tree(), seed in 1_u64..) {
        let mut text = "${".to_owned();
        write(&tree, 0, &mut Dice(seed), &mut text);
        text.push('}');
        let found = evaluate(&text, (1, 3), &parameter).map(|evaluated| evaluated.value);
        let expected = is_truth(&tree).map(|_| oracle(&tree));
        let agree = match (&found, expected) {
            (Err(fault), None) => fault.kind == FaultKind::Types,
            (Err(fault), Some(None)) => fault.kind == FaultKind::Evaluation,
            (Ok(Value::Integer(x)), Some(Some(Known::Whole(y)))) => i128::from(*x) == y,
            (Ok(Value::Double(x)), Some(Some(Known::Fraction(y)))) => *x == y,
            (Ok(Value::Boolean(x)), Some(Some(Known::Truth(y)))) => *x == y,
            _ => false,
        };
        prop_assert!(agree, "{text}: {found:?}, not {expected:?}");
    }
}

/// An expression in the form of the oracle.
#[derive(Debug, Clone)]
enum Tree {
    Whole(i64),
    Fraction(&'static str),
    Truth(bool),
    Named(&'static str),
    Before(&'static str, Box<Tree>),
    Between(&'static str, Box<[Tree; 2]>),
    Called(&'static str, Vec<Tree>),
}

/// A value in the form of the oracle. Integers are wide and are checked afterwards.
#[derive(Debug, Clone, Copy)]
enum Known {
    Whole(i128),
    Fraction(f64),
    Truth(bool),
}

fn number() -> BoxedStrategy<Tree> {
    let leaf = prop_oneof![
        4 => (0..10_i64).prop_map(Tree::Whole),
        1 => (i64::MAX - 3..=i64::MAX).prop_map(Tree::Whole),
        3 => prop::sample::select(vec!["0.0", "0.5", "2.50", "1e3", "15E-1", "1.5e308", "1e-300"])
            .prop_map(Tree::Fraction),
        2 => prop::sample::select(vec!["zero", "half", "one", "smallest"]).prop_map(Tree::Named),
    ];
    leaf.prop_recursive(5, 24, 2, |inner| arithmetic(inner.clone(), inner))
        .boxed()
}

fn arithmetic(inner: BoxedStrategy<Tree>, other: BoxedStrategy<Tree>) -> BoxedStrategy<Tree> {
    let signs = prop::sample::select(vec!["+", "-", "*", "/", "%"]);
    let ones = prop::sample::select(vec![
        "round", "floor", "ceil", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sign",
        "abs",
    ]);
    let twos = prop::sample::select(vec!["pow", "max", "min"]);
    let pair = (inner.clone(), other).prop_map(|(l, r)| [l, r]);
    prop_oneof![
        1 => inner.clone().prop_map(|x| Tree::Before("-", Box::new(x))),
        5 => (signs, pair.clone()).prop_map(|(sign, pair)| Tree::Between(sign, Box::new(pair))),
        2 => (ones, inner).prop_map(|(name, x)| Tree::Called(name, vec![x])),
        2 => (twos, pair).prop_map(|(name, pair)| Tree::Called(name, pair.into())),
    ]
    .boxed()
}

fn truth() -> BoxedStrategy<Tree> {
    let leaf = prop_oneof![
        any::<bool>().prop_map(Tree::Truth),
        Just(Tree::Named("yes"))
    ];
    leaf.prop_recursive(5, 24, 2, |inner| logic(inner.clone(), inner))
        .boxed()
}

fn logic(inner: BoxedStrategy<Tree>, other: BoxedStrategy<Tree>) -> BoxedStrategy<Tree> {
    let words = prop::sample::select(vec!["and", "or"]);
    prop_oneof![
        inner.clone().prop_map(|x| Tree::Before("not", Box::new(x))),
        (words, inner, other).prop_map(|(word, l, r)| Tree::Between(word, Box::new([l, r]))),
    ]
    .boxed()
}

/// Generates mostly well-typed expressions, and some with a part of the other type.
fn tree() -> BoxedStrategy<Tree> {
    let mixed = prop_oneof![
        arithmetic(number(), truth()),
        logic(truth(), number()),
        arithmetic(truth(), truth()),
        logic(number(), truth()),
    ];
    prop_oneof![5 => number(), 2 => truth(), 2 => mixed].boxed()
}

/// Returns whether the tree is a boolean, or `None` if its types do not fit.
fn is_truth(tree: &Tree) -> Option<bool> {
    let all = |parts: &[Tree], wanted: bool| {
        let fit = parts.iter().all(|part| is_truth(part) == Some(wanted));
        fit.then_some(wanted)
    };
    match tree {
        Tree::Whole(_) | Tree::Fraction(_) => Some(false),
        Tree::Truth(_) => Some(true),
        Tree::Named(name) => Some(*name == "yes"),
        Tree::Before(word, x) => all(std::slice::from_ref(x), *word == "not"),
        Tree::Between(word, pair) => all(pair.as_slice(), matches!(*word, "and" | "or")),
        Tree::Called(_, arguments) => all(arguments, false),
    }
}

/// Returns the value of a tree with correct types.
fn oracle(tree: &Tree) -> Option<Known> {
    let known = match tree {
        Tree::Whole(value) => Known::Whole(i128::from(*value)),
        Tree::Fraction(text) => Known::Fraction(text.parse().ok()?),
        Tree::Truth(value) => Known::Truth(*value),
        Tree::Named(name) => match parameter(name) {
            Operand::Value(Value::Integer(value)) => Known::Whole(i128::from(value)),
            Operand::Value(Value::Double(value)) => Known::Fraction(value),
            Operand::Value(Value::Boolean(value)) => Known::Truth(value),
            _ => return None,
        },
        Tree::Before(_, x) => match oracle(x)? {
            Known::Whole(x) => Known::Whole(-x),
            Known::Fraction(x) => Known::Fraction(-x),
            Known::Truth(x) => Known::Truth(!x),
        },
        Tree::Between(word, pair) => two(word, oracle(&pair[0])?, oracle(&pair[1])?),
        Tree::Called(name, arguments) => match arguments.as_slice() {
            [x] => one(name, oracle(x)?),
            [x, y] => two(name, oracle(x)?, oracle(y)?),
            _ => return None,
        },
    };
    match known {
        Known::Whole(value) => i64::try_from(value).is_ok().then_some(known),
        // A result outside the domain of a function is not finite.
        Known::Fraction(value) => value.is_finite().then_some(known),
        Known::Truth(_) => Some(known),
    }
}

fn one(name: &str, x: Known) -> Known {
    let double = fraction(x);
    let towards_zero = double.trunc();
    let rest = double - towards_zero;
    let whole = |value: f64| match x {
        Known::Fraction(_) if i64::try_from(value as i128).is_ok() => Known::Whole(value as i128),
        Known::Fraction(_) => Known::Fraction(value),
        _ => x,
    };
    match (name, x) {
        ("round", _) if rest.abs() >= 0.5 => whole(towards_zero + double.signum()),
        ("round", _) => whole(towards_zero),
        ("floor", _) if rest < 0.0 => whole(towards_zero - 1.0),
        ("ceil", _) if rest > 0.0 => whole(towards_zero + 1.0),
        ("floor" | "ceil", _) => whole(towards_zero),
        ("sign", _) if double == 0.0 => Known::Whole(0),
        ("sign", _) => Known::Whole(double.signum() as i128),
        ("abs", Known::Whole(x)) => Known::Whole(x.abs()),
        ("abs", _) => Known::Fraction(double.abs()),
        ("sqrt", _) => Known::Fraction(double.sqrt()),
        ("sin", _) => Known::Fraction(double.sin()),
        ("cos", _) => Known::Fraction(double.cos()),
        ("tan", _) => Known::Fraction(double.tan()),
        ("asin", _) => Known::Fraction(double.asin()),
        ("acos", _) => Known::Fraction(double.acos()),
        _ => Known::Fraction(double.atan()),
    }
}

fn two(word: &str, x: Known, y: Known) -> Known {
    match (word, x, y) {
        ("and", Known::Truth(x), Known::Truth(y)) => return Known::Truth(x & y),
        ("or", Known::Truth(x), Known::Truth(y)) => return Known::Truth(x | y),
        ("+", Known::Whole(x), Known::Whole(y)) => return Known::Whole(x + y),
        ("-", Known::Whole(x), Known::Whole(y)) => return Known::Whole(x - y),
        ("*", Known::Whole(x), Known::Whole(y)) => return Known::Whole(x * y),
        ("%", Known::Whole(x), Known::Whole(y)) if y != 0 => return Known::Whole(x % y),
        ("max", Known::Whole(x), Known::Whole(y)) => return Known::Whole(x.max(y)),
        ("min", Known::Whole(x), Known::Whole(y)) => return Known::Whole(x.min(y)),
        _ => {}
    }
    let (x, y) = (fraction(x), fraction(y));
    Known::Fraction(match word {
        "+" => x + y,
        "-" => x - y,
        "*" => x * y,
        "/" => x / y,
        "%" => x % y,
        "pow" => x.powf(y),
        "max" if x > y => x,
        "min" if x < y => x,
        _ => y,
    })
}

fn fraction(known: Known) -> f64 {
    match known {
        Known::Whole(value) => value as f64,
        Known::Fraction(value) => value,
        Known::Truth(_) => f64::NAN,
    }
}

/// A cheap random generator with the same choices on every machine.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 33).unwrap_or(0) % end.max(1)
    }

    fn blank(&mut self) -> &'static str {
        ["", "", " ", "  ", "\n"][self.below(5)]
    }
}

/// Returns the binding strength of a tree's operator.
fn binding(tree: &Tree) -> u8 {
    match tree {
        Tree::Between("or", _) => 1,
        Tree::Between("and", _) => 2,
        Tree::Before("not", _) => 3,
        Tree::Between("+" | "-", _) => 4,
        Tree::Between(..) => 5,
        Tree::Before(..) => 6,
        _ => 7,
    }
}

/// Writes a tree into a place that requires at least the binding strength `needed`, with
/// superfluous blanks and brackets.
fn write(tree: &Tree, needed: u8, dice: &mut Dice, out: &mut String) {
    out.push_str(dice.blank());
    if binding(tree) < needed || dice.below(5) == 0 {
        out.push('(');
        write(tree, 0, dice, out);
        out.push(')');
        out.push_str(dice.blank());
        return;
    }
    match tree {
        Tree::Whole(value) => out.push_str(&value.to_string()),
        Tree::Fraction(text) => out.push_str(text),
        Tree::Truth(value) => out.push_str(&value.to_string()),
        Tree::Named(name) => out.push_str(&format!("${name}")),
        Tree::Before(word, x) => {
            out.push_str(word);
            out.push_str(if *word == "not" { " " } else { "" });
            write(x, binding(tree), dice, out);
        }
        Tree::Between(word, pair) => {
            let blank = if word.len() > 1 { " " } else { "" };
            write(&pair[0], binding(tree), dice, out);
            out.push_str(&format!("{blank}{word}{blank}"));
            write(&pair[1], binding(tree) + 1, dice, out);
        }
        Tree::Called(name, arguments) => {
            out.push_str(name);
            out.push_str(dice.blank());
            for (i, argument) in arguments.iter().enumerate() {
                out.push(if i == 0 { '(' } else { ',' });
                write(argument, 0, dice, out);
            }
            out.push(')');
        }
    }
    out.push_str(dice.blank());
}
