//! Arithmetic of the operators and functions.
//!
//! Integers are exact or fail. Doubles are finite or fail, unless an infinite operand vanishes as
//! in `min($infinite, 5)`. Errors state the failure without its location.

use std::fmt;

/// A number with its type.
#[derive(Clone, Copy)]
pub(super) enum Number {
    Integer(i64),
    Double(f64),
}

/// A number and the precision that was lost in its computation.
pub(super) struct Computed {
    pub number: Number,
    pub imprecise: Option<String>,
}

/// A computed number, or the reason why there is none.
pub(super) type Outcome = Result<Computed, String>;

/// Implementation of a function of one argument.
pub(super) type OfOne = fn(Number) -> Outcome;

/// Implementation of an operator or a function of two arguments.
pub(super) type OfTwo = fn(Number, Number) -> Outcome;

/// Returns the number that `literal` stands for. The literal must follow the grammar.
pub(super) fn literal(literal: &str) -> Outcome {
    if literal.bytes().all(|digit| digit.is_ascii_digit()) {
        return match literal.parse() {
            Ok(value) => exact(Number::Integer(value)),
            Err(_) => Err(format!(
                "{} is larger than any integer, which is at most {}; add `.0` to make it a double",
                super::quoted(literal),
                i64::MAX
            )),
        };
    }
    let value: f64 = literal.parse().unwrap_or(f64::INFINITY);
    if !value.is_finite() {
        let shown = super::quoted(literal);
        return Err(format!("{shown} is larger than any double"));
    }
    let mut digits = literal.bytes().take_while(|c| !matches!(c, b'e' | b'E'));
    let vanished = value == 0.0 && digits.any(|c| matches!(c, b'1'..=b'9'));
    Ok(Computed {
        number: Number::Double(value),
        imprecise: vanished.then(|| format!("{} becomes 0", super::quoted(literal))),
    })
}

pub(super) fn add(left: Number, right: Number) -> Outcome {
    match (left, right) {
        (Number::Integer(l), Number::Integer(r)) => integer(l.checked_add(r), "+"),
        _ => doubles("+", left, right, |l, r| l + r),
    }
}

pub(super) fn subtract(left: Number, right: Number) -> Outcome {
    match (left, right) {
        (Number::Integer(l), Number::Integer(r)) => integer(l.checked_sub(r), "-"),
        _ => doubles("-", left, right, |l, r| l - r),
    }
}

pub(super) fn multiply(left: Number, right: Number) -> Outcome {
    match (left, right) {
        (Number::Integer(l), Number::Integer(r)) => integer(l.checked_mul(r), "*"),
        _ => watch_underflow("*", left, right, doubles("*", left, right, |l, r| l * r)),
    }
}

pub(super) fn divide(left: Number, right: Number) -> Outcome {
    if right.is_zero() {
        return Err(by_zero("/"));
    }
    let quotient = doubles("/", left, right, |l, r| l / r);
    watch_underflow("/", left, right, quotient)
}

pub(super) fn remainder(left: Number, right: Number) -> Outcome {
    match (left, right) {
        _ if right.is_zero() => Err(by_zero("%")),
        // Only the remainder of a division by -1 wraps. Its result 0 is correct.
        (Number::Integer(l), Number::Integer(r)) => exact(Number::Integer(l.wrapping_rem(r))),
        _ => doubles("%", left, right, |l, r| l % r),
    }
}

pub(super) fn minus(operand: Number) -> Outcome {
    match operand {
        Number::Integer(value) => integer(value.checked_neg(), "-"),
        Number::Double(_) => double("-", operand, |x| -x),
    }
}

pub(super) fn round(x: Number) -> Outcome {
    whole("round", x, f64::round)
}

pub(super) fn floor(x: Number) -> Outcome {
    whole("floor", x, f64::floor)
}

pub(super) fn ceil(x: Number) -> Outcome {
    whole("ceil", x, f64::ceil)
}

pub(super) fn sqrt(x: Number) -> Outcome {
    if x.value() < 0.0 {
        return Err(format!("`sqrt` takes no negative number, found {x}"));
    }
    double("sqrt", x, f64::sqrt)
}

pub(super) fn sin(x: Number) -> Outcome {
    double("sin", x, f64::sin)
}

pub(super) fn cos(x: Number) -> Outcome {
    double("cos", x, f64::cos)
}

pub(super) fn tan(x: Number) -> Outcome {
    double("tan", x, f64::tan)
}

pub(super) fn asin(x: Number) -> Outcome {
    within_one("asin", x)?;
    double("asin", x, f64::asin)
}

pub(super) fn acos(x: Number) -> Outcome {
    within_one("acos", x)?;
    double("acos", x, f64::acos)
}

pub(super) fn atan(x: Number) -> Outcome {
    double("atan", x, f64::atan)
}

pub(super) fn sign(x: Number) -> Outcome {
    let value = x.value();
    let sign = i64::from(value > 0.0) - i64::from(value < 0.0);
    exact(Number::Integer(sign))
}

pub(super) fn abs(x: Number) -> Outcome {
    match x {
        Number::Integer(value) => integer(value.checked_abs(), "abs"),
        Number::Double(_) => double("abs", x, f64::abs),
    }
}

pub(super) fn pow(base: Number, exponent: Number) -> Outcome {
    let (b, e) = (base.value(), exponent.value());
    if b == 0.0 && e < 0.0 {
        return Err(format!(
            "`pow` of 0 takes no negative exponent, found {exponent}"
        ));
    }
    if b < 0.0 && e.fract() != 0.0 {
        return Err(format!(
            "`pow` of a negative number takes a whole exponent, found {exponent}"
        ));
    }
    let power = doubles("pow", base, exponent, f64::powf);
    watch_underflow("pow", base, exponent, power)
}

pub(super) fn max(x: Number, y: Number) -> Outcome {
    match (x, y) {
        (Number::Integer(x), Number::Integer(y)) => exact(Number::Integer(x.max(y))),
        _ => doubles("max", x, y, f64::max),
    }
}

pub(super) fn min(x: Number, y: Number) -> Outcome {
    match (x, y) {
        (Number::Integer(x), Number::Integer(y)) => exact(Number::Integer(x.min(y))),
        _ => doubles("min", x, y, f64::min),
    }
}

fn exact(number: Number) -> Outcome {
    Ok(Computed {
        number,
        imprecise: None,
    })
}

/// Returns an integer if the operation `by` did not overflow.
fn integer(value: Option<i64>, by: &str) -> Outcome {
    let overflow = || format!("the result of `{by}` does not fit into a 64-bit integer");
    exact(Number::Integer(value.ok_or_else(overflow)?))
}

/// Applies a function to a double.
fn double(by: &str, x: Number, function: fn(f64) -> f64) -> Outcome {
    Ok(Computed {
        number: finite(by, function(x.value()))?,
        imprecise: x.lost_as_double(),
    })
}

/// Applies an operation to two doubles.
fn doubles(by: &str, x: Number, y: Number, operation: fn(f64, f64) -> f64) -> Outcome {
    Ok(Computed {
        number: finite(by, operation(x.value(), y.value()))?,
        imprecise: x.lost_as_double().or_else(|| y.lost_as_double()),
    })
}

fn finite(by: &str, value: f64) -> Result<Number, String> {
    if value.is_nan() {
        Err(format!("the result of `{by}` is not a number"))
    } else if value.is_infinite() {
        Err(format!("the result of `{by}` is larger than any double"))
    } else {
        Ok(Number::Double(value))
    }
}

/// Returns `outcome` of `by`. Adds a remark if the result is zero and both operands are finite and
/// not zero.
fn watch_underflow(by: &str, x: Number, y: Number, outcome: Outcome) -> Outcome {
    let usual = |operand: Number| operand.value().is_finite() && !operand.is_zero();
    let mut computed = outcome?;
    if computed.number.is_zero() && usual(x) && usual(y) {
        let remark = || format!("the result of `{by}` becomes 0, although no operand is 0");
        computed.imprecise = computed.imprecise.or_else(|| Some(remark()));
    }
    Ok(computed)
}

/// Returns the whole number that `function` computes from `x`. The result is an integer if it fits
/// into one.
fn whole(by: &str, x: Number, function: fn(f64) -> f64) -> Outcome {
    /// 2⁶³, the first double that exceeds the integers.
    const END: f64 = 9_223_372_036_854_775_808.0;
    let Number::Double(value) = x else {
        return exact(x);
    };
    let value = function(value);
    if (-END..END).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "it is whole and within range"
        )]
        return exact(Number::Integer(value as i64));
    }
    exact(finite(by, value)?)
}

fn within_one(by: &str, x: Number) -> Result<(), String> {
    if (-1.0..=1.0).contains(&x.value()) {
        Ok(())
    } else {
        Err(format!("`{by}` takes numbers from -1 to 1, found {x}"))
    }
}

fn by_zero(operator: &str) -> String {
    format!("division by zero: the right operand of `{operator}` is 0")
}

impl Number {
    /// Returns the number as a double. For an integer this is the nearest double.
    fn value(self) -> f64 {
        match self {
            Number::Integer(value) => value as f64,
            Number::Double(value) => value,
        }
    }

    fn is_zero(self) -> bool {
        self.value() == 0.0
    }

    /// Returns the precision that is lost when the number is used as a double. Up to 2⁵³ no
    /// precision is lost.
    fn lost_as_double(self) -> Option<String> {
        let Number::Integer(value) = self else {
            return None;
        };
        // 128 bits are needed because the double nearest to the largest integer does not fit into
        // 64 bits.
        let becomes = self.value() as i128;
        let lost = becomes != i128::from(value);
        lost.then(|| format!("the integer {value} becomes {becomes} as a double"))
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Number::Integer(value) => write!(f, "{value}"),
            // `Debug` writes large and small numbers with an exponent.
            Number::Double(value) => write!(f, "{value:?}"),
        }
    }
}
