//! Constraints of parameters. A value must satisfy all constraints of at least one group.

use std::borrow::Cow;

use super::values;
use crate::prelude::*;
use qcbus_openscenario::DateTime;

/// Comparison of two values: the words of `rule`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Comparison {
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

impl Comparison {
    /// Returns the comparison that a `rule` stands for.
    pub(crate) fn of(element: Element<'_, '_>) -> Option<Comparison> {
        Some(match &*element.word("rule")? {
            "equalTo" => Comparison::Equal,
            "notEqualTo" => Comparison::NotEqual,
            "lessThan" => Comparison::Less,
            "lessOrEqual" => Comparison::LessOrEqual,
            "greaterThan" => Comparison::Greater,
            "greaterOrEqual" => Comparison::GreaterOrEqual,
            _ => return None,
        })
    }

    /// Returns the word of `rule`.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Comparison::Equal => "equalTo",
            Comparison::NotEqual => "notEqualTo",
            Comparison::Less => "lessThan",
            Comparison::LessOrEqual => "lessOrEqual",
            Comparison::Greater => "greaterThan",
            Comparison::GreaterOrEqual => "greaterOrEqual",
        }
    }

    /// Checks whether the comparison needs an order.
    pub(crate) fn is_order(self) -> bool {
        !matches!(self, Comparison::Equal | Comparison::NotEqual)
    }
}

/// A value that can be compared.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Operand<'d> {
    /// A number, or a point in time in seconds, in UTC.
    Number(f64),
    /// A point in time in seconds with an unknown time zone.
    Local(f64),
    /// A text, or `true` and `false`.
    Text(Cow<'d, str>),
}

impl<'d> Operand<'d> {
    /// Converts the value to an operand of a type. Returns `None` for NaN, which does not compare.
    pub(crate) fn new(value: &Value<'d>, data_type: DataType) -> Option<Operand<'d>> {
        match data_type {
            DataType::String => Some(Operand::Text(value.text())),
            DataType::Boolean => Some(Operand::Text(Value::Boolean(value.flag()?).text())),
            DataType::DateTime => {
                let time = DateTime::parse(&value.text()).ok()?;
                Some(if time.has_zone {
                    Operand::Number(time.seconds)
                } else {
                    Operand::Local(time.seconds)
                })
            }
            _ => {
                let number = value.number().filter(|number| !number.is_nan())?;
                Some(Operand::Number(number))
            }
        }
    }

    /// Checks whether the comparison holds. It tolerates doubles that differ in their last digits.
    /// Returns `None` if the two values have no order.
    pub(crate) fn holds(&self, comparison: Comparison, other: &Operand<'_>) -> Option<bool> {
        match (self, other) {
            (Operand::Number(left), Operand::Number(right))
            | (Operand::Local(left), Operand::Local(right)) => {
                let (left, right) = (*left, *right);
                let near = left == right
                    || (left - right).abs() <= 1e-9 * f64::max(left.abs(), right.abs());
                Some(match comparison {
                    Comparison::Equal => near,
                    Comparison::NotEqual => left != right,
                    Comparison::Less => left < right,
                    Comparison::LessOrEqual => left < right || near,
                    Comparison::Greater => left > right,
                    Comparison::GreaterOrEqual => left > right || near,
                })
            }
            (Operand::Text(left), Operand::Text(right)) => match comparison {
                Comparison::Equal => Some(left == right),
                Comparison::NotEqual => Some(left != right),
                _ => None,
            },
            _ => None,
        }
    }
}

/// A `ValueConstraint`. Unknown parts are `None`.
pub(crate) struct Constraint<'m, 'd> {
    pub(crate) element: Element<'m, 'd>,
    pub(crate) comparison: Option<Comparison>,
    operand: Option<Operand<'d>>,
}

impl Constraint<'_, '_> {
    /// Formats the constraint for messages, for example `lessThan 5`.
    pub(crate) fn shown(&self) -> String {
        let rule = self.comparison.map_or("", Comparison::word);
        let value = self.element.text("value").unwrap_or_default();
        format!("`{rule} {}`", values::short(&value))
    }
}

/// A `ConstraintGroup`.
pub(crate) struct Group<'m, 'd> {
    pub(crate) element: Element<'m, 'd>,
    pub(crate) constraints: Vec<Constraint<'m, 'd>>,
}

/// Returns the constraint groups of a declaration.
pub(crate) fn groups<'m, 'd>(
    declaration: Element<'m, 'd>,
    data_type: DataType,
) -> Vec<Group<'m, 'd>> {
    let groups = declaration.children_named("ConstraintGroup");
    let groups = groups.map(|group| {
        let constraints = group.children_named("ValueConstraint").map(|element| {
            let value = values::typed(element, "value", data_type).and_then(Result::ok);
            Constraint {
                element,
                comparison: Comparison::of(element),
                operand: value.and_then(|value| Operand::new(&value, data_type)),
            }
        });
        Group {
            element: group,
            constraints: constraints.collect(),
        }
    });
    groups.collect()
}

impl<'m, 'd> Group<'m, 'd> {
    /// Returns the first constraint that a value violates. Returns `Ok(None)` if it satisfies all,
    /// and `Err` if this is unknown.
    pub(crate) fn violated(&self, value: &Operand<'_>) -> Result<Option<&Constraint<'m, 'd>>, ()> {
        let mut unknown = false;
        for constraint in &self.constraints {
            let pair = constraint.comparison.zip(constraint.operand.as_ref());
            match pair.and_then(|(comparison, operand)| value.holds(comparison, operand)) {
                Some(true) => {}
                Some(false) => return Ok(Some(constraint)),
                None => unknown = true,
            }
        }
        if unknown { Err(()) } else { Ok(None) }
    }

    /// Returns two constraints that no value satisfies at once.
    pub(crate) fn contradiction(
        &self,
        data_type: DataType,
    ) -> Option<(&Constraint<'m, 'd>, &Constraint<'m, 'd>)> {
        let equal = self.known(Comparison::Equal).next();
        if let Some((equal, value)) = equal {
            // With a fixed value, every other constraint is decided.
            let against = self.violated(value).ok().flatten()?;
            return Some((equal, against));
        }
        if data_type == DataType::Boolean {
            let mut excluded = self.known(Comparison::NotEqual);
            let (first, value) = excluded.next()?;
            let (second, _) = excluded.find(|(_, other)| *other != value)?;
            return Some((first, second));
        }
        let (low, least) = self.bound(Comparison::Greater, Comparison::GreaterOrEqual, 1.0)?;
        let (high, most) = self.bound(Comparison::Less, Comparison::LessOrEqual, -1.0)?;
        let of_kind = |one: &Constraint<'_, '_>| matches!(one.operand, Some(Operand::Local(_)));
        let local = self.constraints.iter().filter(|one| of_kind(one)).count();
        if local != 0 && local != self.constraints.len() {
            return None;
        }
        let (low_open, high_open) = (is_open(low), is_open(high));
        let empty = if data_type.range().is_some() {
            let first = if low_open {
                least.floor() + 1.0
            } else {
                least.ceil()
            };
            let last = if high_open {
                most.ceil() - 1.0
            } else {
                most.floor()
            };
            first > last
        } else {
            least > most || (least == most && (low_open || high_open))
        };
        empty.then_some((low, high))
    }

    fn known(
        &self,
        comparison: Comparison,
    ) -> impl Iterator<Item = (&Constraint<'m, 'd>, &Operand<'d>)> {
        let of_kind = self
            .constraints
            .iter()
            .filter(move |one| one.comparison == Some(comparison));
        of_kind.filter_map(|one| Some((one, one.operand.as_ref()?)))
    }

    /// Returns the strictest of the lower bounds (`sign` 1) or upper bounds (`sign` -1).
    fn bound(
        &self,
        open: Comparison,
        closed: Comparison,
        sign: f64,
    ) -> Option<(&Constraint<'m, 'd>, f64)> {
        let mut strictest: Option<(&Constraint<'m, 'd>, f64)> = None;
        for (constraint, operand) in self.known(open).chain(self.known(closed)) {
            let (Operand::Number(value) | Operand::Local(value)) = operand else {
                continue;
            };
            // The open bounds come first. They stay if a closed bound has the same value.
            if strictest.is_none_or(|(_, bound)| sign * value > sign * bound) {
                strictest = Some((constraint, *value));
            }
        }
        strictest
    }
}

fn is_open(constraint: &Constraint<'_, '_>) -> bool {
    matches!(
        constraint.comparison,
        Some(Comparison::Less | Comparison::Greater)
    )
}
