//! Evaluation of an expression tree.
//!
//! One pass finds the types, the value and the gravest fault. The type of a faulty part is known in
//! most cases. The types around it are therefore still checked.

use std::f64::consts::PI;

use super::arithmetic::{self, Number};
use super::tree::{Link, Node, NodeKind};
use super::words::{Action, PI_SINCE};
use super::{Evaluated, Fault, FaultKind, Imprecision, Newer, Operand, Value, Version, quoted};

/// Evaluates `tree`, an expression in a file of this `version`.
pub(super) fn evaluate(
    tree: &Node<'_>,
    version: Version,
    lookup: &dyn Fn(&str) -> Operand,
) -> Result<Evaluated, Fault> {
    let mut evaluator = Evaluator {
        version,
        lookup,
        uses_parameters: false,
        newer: Vec::new(),
        imprecise: None,
    };
    let value = match evaluator.node(tree) {
        Typed::Number(number) => finite(number?, tree.at)?,
        Typed::Boolean(value) => Value::Boolean(value?),
        Typed::Untyped(fault) => return Err(fault),
    };
    Ok(Evaluated {
        value,
        uses_parameters: evaluator.uses_parameters,
        newer: evaluator.newer,
        imprecise: evaluator.imprecise,
    })
}

/// Knowledge about a part: its type, and its value or its gravest fault.
enum Typed {
    Number(Result<Number, Fault>),
    Boolean(Result<bool, Fault>),
    Untyped(Fault),
}

struct Evaluator<'a> {
    version: Version,
    lookup: &'a dyn Fn(&str) -> Operand,
    uses_parameters: bool,
    newer: Vec<Newer>,
    imprecise: Option<Imprecision>,
}

impl Evaluator<'_> {
    fn node(&mut self, node: &Node<'_>) -> Typed {
        let at = node.at;
        match &node.kind {
            NodeKind::Number(text) => Typed::Number(self.computed(at, arithmetic::literal(text))),
            NodeKind::Constant(value) => Typed::from(*value),
            NodeKind::Pi => {
                self.note_newer(at, "pi", PI_SINCE);
                Typed::Number(Ok(Number::Double(PI)))
            }
            NodeKind::Parameter(name) => self.parameter(at, name),
            NodeKind::Minus(operand) => {
                let operand = self.number(operand, "-");
                Typed::Number(operand.and_then(|x| self.computed(at, arithmetic::minus(x))))
            }
            NodeKind::Not(operand) => {
                let value = self.node(operand).boolean(operand.at, "not");
                Typed::Boolean(value.map(|value| !value))
            }
            NodeKind::Chain(first, links) => self.chain(first, links),
            NodeKind::Call1(function, action, x) => {
                self.note_newer(at, function.name, function.since);
                let x = self.number(x, function.name);
                Typed::Number(x.and_then(|x| self.computed(at, action(x))))
            }
            NodeKind::Call2(function, action, arguments) => {
                self.note_newer(at, function.name, function.since);
                let [x, y] = &**arguments;
                let x = self.number(x, function.name);
                let y = self.number(y, function.name);
                Typed::Number(both(x, y).and_then(|(x, y)| self.computed(at, action(x, y))))
            }
        }
    }

    fn number(&mut self, node: &Node<'_>, taker: &str) -> Result<Number, Fault> {
        self.node(node).number(node.at, taker)
    }

    fn chain(&mut self, first: &Node<'_>, links: &[Link<'_>]) -> Typed {
        let mut left = self.node(first);
        for link in links {
            let right = self.node(&link.operand);
            let (symbol, right_at) = (link.operator.symbol, link.operand.at);
            left = match link.operator.action {
                Action::Numbers(action) => {
                    let operands = both(
                        left.number(first.at, symbol),
                        right.number(right_at, symbol),
                    );
                    Typed::Number(operands.and_then(|(l, r)| self.computed(link.at, action(l, r))))
                }
                Action::Booleans(action) => {
                    let operands = both(
                        left.boolean(first.at, symbol),
                        right.boolean(right_at, symbol),
                    );
                    Typed::Boolean(operands.map(|(l, r)| action(l, r)))
                }
            };
        }
        left
    }

    fn parameter(&mut self, at: usize, name: &str) -> Typed {
        self.uses_parameters = true;
        let fault = |kind, what: &str| {
            let parameter = quoted(&format!("${name}"));
            Fault::new(kind, at, format!("{parameter} {what}"))
        };
        Typed::Untyped(match (self.lookup)(name) {
            Operand::Value(Value::Double(value)) if value.is_nan() => {
                let what = "is not a number (NaN), so the expression has no result";
                return Typed::Number(Err(fault(FaultKind::Evaluation, what)));
            }
            Operand::Value(value) => return Typed::from(value),
            Operand::Text(kind) => {
                let what = format!("is of type {kind}; expressions take numbers and booleans");
                fault(FaultKind::Evaluation, &what)
            }
            Operand::Unresolved => fault(FaultKind::Unresolved, "has an invalid declaration"),
            Operand::Undeclared => {
                let kind = FaultKind::Undeclared(name.to_owned());
                fault(kind, "is not a parameter declared here")
            }
            Operand::Variable => {
                let kind = FaultKind::Variable(name.to_owned());
                fault(kind, "is a variable; expressions take parameters only")
            }
        })
    }

    /// Returns the number that was computed at `at`. Records the first loss of precision.
    fn computed(&mut self, at: usize, outcome: arithmetic::Outcome) -> Result<Number, Fault> {
        let computed = outcome.map_err(|why| Fault::evaluation(at, why))?;
        if self.imprecise.is_none() {
            self.imprecise = computed.imprecise.map(|text| Imprecision { at, text });
        }
        Ok(computed.number)
    }

    fn note_newer(&mut self, at: usize, name: &'static str, since: Version) {
        let known = self.newer.iter().any(|newer| newer.name == name);
        if since > self.version && !known {
            self.newer.push(Newer { name, since, at });
        }
    }
}

impl Typed {
    /// Returns the value as an operand at `at` of a `taker` of numbers.
    fn number(self, at: usize, taker: &str) -> Result<Number, Fault> {
        match self {
            Typed::Number(number) => number,
            Typed::Boolean(value) => Err(misfit(at, taker, "numbers", "a boolean", value.err())),
            Typed::Untyped(fault) => Err(fault),
        }
    }

    /// Returns the value as an operand at `at` of a `taker` of booleans.
    fn boolean(self, at: usize, taker: &str) -> Result<bool, Fault> {
        match self {
            Typed::Boolean(value) => value,
            Typed::Number(value) => Err(misfit(at, taker, "booleans", "a number", value.err())),
            Typed::Untyped(fault) => Err(fault),
        }
    }
}

impl From<Value> for Typed {
    fn from(value: Value) -> Typed {
        match value {
            Value::Integer(value) => Typed::Number(Ok(Number::Integer(value))),
            Value::Double(value) => Typed::Number(Ok(Number::Double(value))),
            Value::Boolean(value) => Typed::Boolean(Ok(value)),
        }
    }
}

/// Returns the type fault of an operand, or the fault within it if that is graver.
fn misfit(at: usize, taker: &str, takes: &str, found: &str, inner: Option<Fault>) -> Fault {
    let text = format!("`{taker}` takes {takes}, found {found}");
    let fault = Fault::new(FaultKind::Types, at, text);
    match inner {
        Some(inner) => inner.or_graver(fault),
        None => fault,
    }
}

/// Returns both operands, or the graver fault.
fn both<L, R>(left: Result<L, Fault>, right: Result<R, Fault>) -> Result<(L, R), Fault> {
    match (left, right) {
        (Ok(left), Ok(right)) => Ok((left, right)),
        (Err(left), Err(right)) => Err(left.or_graver(right)),
        (Err(fault), Ok(_)) | (Ok(_), Err(fault)) => Err(fault),
    }
}

/// Returns the result of the whole expression. It can be infinite only if the whole expression is a
/// parameter.
fn finite(number: Number, at: usize) -> Result<Value, Fault> {
    match number {
        Number::Integer(value) => Ok(Value::Integer(value)),
        Number::Double(value) if value.is_finite() => Ok(Value::Double(value)),
        Number::Double(_) => Err(Fault::evaluation(at, "the result is infinite")),
    }
}
