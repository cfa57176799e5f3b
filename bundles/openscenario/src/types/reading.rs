//! Resolution of written text to a value: literals, parameters, expressions.

use std::borrow::Cow;

use crate::Version;
use crate::expr::{self, Evaluated, FaultKind};
use crate::types::data_type::{DataType, Value, integral};
use crate::types::date_time::DateTime;
use crate::types::declaration::{Declaration, Declared, operand};
use crate::types::faults::{Dialect, Problem, ValueFaultKind};
use crate::types::text::{identifier, trim};

/// An attribute as it is understood.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading<'d> {
    /// The attribute is missing.
    Absent,
    /// The attribute is a literal. The schema checks whether it is a value of its type.
    Literal(&'d str),
    /// The value of a parameter or an expression.
    Value(Value<'d>),
    /// The value is unknown. The reason is reported elsewhere.
    Unknown,
}

/// Expected kind of a value.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Expected {
    /// A value of a basic type.
    Type(DataType),
    /// One of these words.
    Words(&'static [Box<str>]),
    /// Any value.
    Unknown,
}

/// Notation of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form<'d> {
    /// A literal.
    Literal,
    /// `$name`
    Parameter(&'d str),
    /// `${…}`
    Expression,
    /// `$name` within a longer text: its offset and the name.
    Embedded(usize, &'d str),
    /// `$(…)`
    Ros(usize),
}

impl<'d> Form<'d> {
    /// Returns the notation of an attribute's value.
    pub(crate) fn of(raw: &'d str) -> Form<'d> {
        let Some(first) = raw.find('$') else {
            return Form::Literal;
        };
        let text = trim(raw);
        if text.starts_with("${") {
            return Form::Expression;
        }
        if let Some(name) = text.strip_prefix('$')
            && !name.is_empty()
            && identifier(name).len() == name.len()
        {
            return Form::Parameter(name);
        }
        let mut at = first;
        loop {
            let rest = &raw[at + 1..];
            let name = identifier(rest);
            if !name.is_empty() {
                return Form::Embedded(at, name);
            }
            if rest.starts_with('(') {
                return Form::Ros(at);
            }
            match rest.find('$') {
                Some(next) => at += 1 + next,
                None => return Form::Literal,
            }
        }
    }
}

/// Resolves a text to a value of the expected kind.
pub(crate) fn resolve<'m, 'd: 'm>(
    raw: &'d str,
    expected: Expected,
    version: Version,
    lookup: &dyn Fn(&str) -> Option<&'m Declaration<'d>>,
) -> Result<Value<'d>, Problem<'d>> {
    match Form::of(raw) {
        Form::Literal => literal(raw, expected),
        Form::Parameter(name) => parameter(name, expected, lookup),
        Form::Expression => expression(raw, expected, version, lookup),
        Form::Embedded(at, name) => Err(Problem {
            name: name.to_owned(),
            ..Problem::new(
                ValueFaultKind::Embedded,
                at,
                format!(
                    "`${name}` is within a longer text, where the standard replaces no parameters: a parameter \
                     must be the whole value or part of an expression `${{…}}`"
                ),
            )
        }),
        Form::Ros(at) => {
            let dialect = Dialect::Ros;
            let text = format!(
                "`$(` begins {}, which is not part of the standard",
                dialect.name()
            );
            Err(Problem::new(ValueFaultKind::Dialect(dialect), at, text))
        }
    }
}

fn literal<'d>(raw: &'d str, expected: Expected) -> Result<Value<'d>, Problem<'d>> {
    let Expected::Type(data_type) = expected else {
        return Ok(Value::Text(Cow::Borrowed(raw)));
    };
    data_type.parse(raw).ok_or_else(|| {
        let allowed = match data_type {
            DataType::DateTime => DateTime::parse(raw)
                .err()
                .map(|error| format!(": it {error}")),
            _ => None,
        };
        let allowed = allowed.unwrap_or_else(|| format!("; expected {}", data_type.allowed()));
        let shown = if raw.is_empty() {
            "an empty text".to_owned()
        } else {
            format!("`{raw}`")
        };
        let text = format!(
            "{shown} is not a value of type `{}`{allowed}",
            data_type.word()
        );
        Problem::new(ValueFaultKind::Declared, 0, text)
    })
}

fn parameter<'m, 'd: 'm>(
    name: &'d str,
    expected: Expected,
    lookup: &dyn Fn(&str) -> Option<&'m Declaration<'d>>,
) -> Result<Value<'d>, Problem<'d>> {
    let named = |problem| Problem {
        name: name.to_owned(),
        ..problem
    };
    let Some(declaration) = lookup(name) else {
        let text = format!("the parameter `{name}` is not declared in the scope of this element");
        return Err(named(Problem::new(ValueFaultKind::Undeclared, 0, text)));
    };
    let Declared::Value(value) = &declaration.declared else {
        return Err(named(unresolved()));
    };
    fit_parameter(value, expected).map_err(|(kind, allowed)| {
        let text = format!(
            "the value of `${name}` is `{}`, but must be {allowed}",
            value.text()
        );
        named(Problem::new(kind, 0, text))
    })
}

/// Returns a problem that follows from a fault that is reported elsewhere.
/// [`crate::Scenario::faults`] does not list it.
fn unresolved<'d>() -> Problem<'d> {
    Problem::new(ValueFaultKind::Undeclared, 0, String::new())
}

impl Problem<'_> {
    /// Checks whether it only follows from a fault that is reported elsewhere.
    pub(crate) fn is_silent(&self) -> bool {
        self.text.is_empty()
    }
}

/// Lists the allowed words. The most likely one is shown as a question.
fn one_of(found: &str, words: &[Box<str>]) -> String {
    const MOST: usize = 12;
    let shown = words.iter().take(MOST);
    let list: Vec<String> = shown.map(|word| format!("`{word}`")).collect();
    let mut text = format!("one of {}", list.join(", "));
    if words.len() > MOST {
        text.push_str(&format!(" and {} more", words.len() - MOST));
    }
    if let Some(near) = qcbus_schema::closest(found, words.iter().map(|word| &**word)) {
        text.push_str(&format!("; perhaps `{near}` is meant"));
    }
    text
}

fn fit_parameter<'d>(
    value: &Value<'d>,
    expected: Expected,
) -> Result<Value<'d>, (ValueFaultKind, String)> {
    let wrong = |data_type: DataType| (ValueFaultKind::Parameter, data_type.allowed().to_owned());
    match expected {
        Expected::Unknown => Ok(value.clone()),
        Expected::Words(words) => {
            let text = value.text();
            if words.iter().any(|word| **word == *text) {
                Ok(Value::Text(text))
            } else {
                Err((ValueFaultKind::Word, one_of(&text, words)))
            }
        }
        Expected::Type(data_type) => match data_type {
            DataType::String => Ok(Value::Text(value.text())),
            DataType::Double => value
                .number()
                .map(Value::Double)
                .ok_or_else(|| wrong(data_type)),
            DataType::Boolean => value
                .flag()
                .map(Value::Boolean)
                .ok_or_else(|| wrong(data_type)),
            DataType::DateTime => match DateTime::parse(&value.text()) {
                Ok(_) => Ok(Value::Text(value.text())),
                Err(_) => Err(wrong(data_type)),
            },
            DataType::Int | DataType::UnsignedInt | DataType::UnsignedShort => {
                let integer = value.integer().filter(|integer| {
                    data_type
                        .range()
                        .is_some_and(|range| range.contains(integer))
                });
                integer.map(Value::Integer).ok_or_else(|| wrong(data_type))
            }
        },
    }
}

fn expression<'m, 'd: 'm>(
    raw: &'d str,
    expected: Expected,
    version: Version,
    lookup: &dyn Fn(&str) -> Option<&'m Declaration<'d>>,
) -> Result<Value<'d>, Problem<'d>> {
    let takes_none = match expected {
        Expected::Type(data_type @ (DataType::String | DataType::DateTime)) => {
            Some(data_type.word())
        }
        Expected::Words(_) => Some("enumeration"),
        Expected::Type(_) | Expected::Unknown => None,
    };
    if let Some(word) = takes_none {
        let text = format!(
            "expected a value of type `{word}`, found an expression: it is not evaluated there, but a parameter \
             `$name` would be replaced"
        );
        let is_text = matches!(expected, Expected::Type(DataType::String));
        let value = is_text.then_some(Value::Text(Cow::Borrowed(raw)));
        return Err(Problem {
            value,
            ..Problem::new(ValueFaultKind::InText, 0, text)
        });
    }
    let operands = |name: &str| operand(lookup(name));
    let evaluated = expr::evaluate(raw, version, &operands).map_err(faulty)?;
    fit_result(&evaluated, expected)
}

fn faulty<'d>(fault: expr::Fault) -> Problem<'d> {
    let (kind, name) = match fault.kind {
        FaultKind::Operator => (ValueFaultKind::Operator, String::new()),
        FaultKind::Arguments => (ValueFaultKind::Arguments, String::new()),
        FaultKind::Types => (ValueFaultKind::Types, String::new()),
        FaultKind::Evaluation => (ValueFaultKind::Evaluation, String::new()),
        FaultKind::Limit => (ValueFaultKind::Limit, String::new()),
        FaultKind::Undeclared(name) => (ValueFaultKind::Undeclared, name),
        FaultKind::Variable(name) => (ValueFaultKind::Variable, name),
        FaultKind::Unresolved => return unresolved(),
    };
    Problem {
        name,
        ..Problem::new(kind, fault.at, fault.text)
    }
}

fn fit_result<'d>(evaluated: &Evaluated, expected: Expected) -> Result<Value<'d>, Problem<'d>> {
    let value: Value<'d> = evaluated.value.into();
    let Expected::Type(data_type) = expected else {
        return Ok(value);
    };
    let wrong = || {
        let text = format!(
            "the result is `{}`, but must be {}",
            value.text(),
            data_type.allowed()
        );
        Problem::new(ValueFaultKind::Result, 0, text)
    };
    match (&value, data_type.range()) {
        (Value::Boolean(_), _) if data_type == DataType::Boolean => Ok(value),
        (Value::Integer(integer), None) if data_type == DataType::Double => {
            Ok(Value::Double(*integer as f64))
        }
        (Value::Double(_), None) if data_type == DataType::Double => Ok(value),
        (Value::Integer(integer), Some(range)) if range.contains(integer) => Ok(value),
        (Value::Double(double), Some(range)) => {
            let integer = integral(*double).filter(|integer| range.contains(integer));
            let integer = integer.ok_or_else(wrong)?;
            let text = format!(
                "the result is `{integer}` of type `double`, expected {}; `round(…)`, `floor(…)` and `ceil(…)` \
                 give whole numbers",
                data_type.allowed()
            );
            let value = Some(Value::Integer(integer));
            Err(Problem {
                value,
                ..Problem::new(ValueFaultKind::Narrowed, 0, text)
            })
        }
        _ => Err(wrong()),
    }
}
