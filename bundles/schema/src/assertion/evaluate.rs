//! Evaluation of an assertion for an element.

use std::collections::HashSet;
use std::ops::ControlFlow;

use qcbus_document::{Document, Node};

use super::{Assertion, Expr, Path, PathStep, Relation};
use crate::edition::Edition;
use crate::names::NameId;
use crate::simple::{XML_SPACE, float_value, is_float};
use crate::work;

/// Context of an assertion: a document with its names translated to the schema's numbers.
#[derive(Clone, Copy)]
pub(crate) struct Scope<'a, 'm> {
    pub(crate) document: Document<'a>,
    /// The schema's number for each name number of the document.
    pub(crate) names: &'m [NameId],
}

/// A comparison between values that cannot be compared. XPath raises an error for it. An assertion
/// that raises an error does not hold.
#[derive(Debug)]
struct Clash;

impl Assertion {
    /// Checks whether the assertion holds for `node`.
    pub(crate) fn holds(&self, node: Node<'_>, scope: &Scope<'_, '_>) -> bool {
        truth(&self.root, node, scope).unwrap_or(false)
    }
}

fn truth(expr: &Expr, node: Node<'_>, scope: &Scope<'_, '_>) -> Result<bool, Clash> {
    match expr {
        Expr::And(parts) => {
            for part in parts {
                if !truth(part, node, scope)? {
                    return Ok(false);
                }
            }
            Ok(true)
        }
        Expr::Or(parts) => {
            for part in parts {
                if truth(part, node, scope)? {
                    return Ok(true);
                }
            }
            Ok(false)
        }
        Expr::Not(inner) => truth(inner, node, scope).map(|holds| !holds),
        Expr::If(parts) => {
            let [test, yes, no] = &**parts;
            let branch = if truth(test, node, scope)? { yes } else { no };
            truth(branch, node, scope)
        }
        Expr::Compare(relation, sides) => compare(*relation, sides, node, scope),
        Expr::Path(path) => Ok(visit(path, node, scope, &mut |_| ControlFlow::Break(()))),
        Expr::Bool(value) => Ok(*value),
        Expr::Count(_) | Expr::CountDistinct(_) | Expr::Number(_) => {
            let number = number(expr, node, scope).unwrap_or(0.0);
            Ok(number != 0.0 && !number.is_nan())
        }
        Expr::Text(text) => Ok(!text.is_empty()),
    }
}

fn compare(
    relation: Relation,
    sides: &[Expr; 2],
    node: Node<'_>,
    scope: &Scope<'_, '_>,
) -> Result<bool, Clash> {
    let [left, right] = sides;
    if let (Some(left), Some(right)) = (number(left, node, scope), number(right, node, scope)) {
        return Ok(relation.holds(&left, &right));
    }
    match (left, right) {
        (Expr::Path(path), literal) => any_value(relation, path, literal, false, node, scope),
        (literal, Expr::Path(path)) => any_value(relation, path, literal, true, node, scope),
        _ => Err(Clash),
    }
}

/// Evaluates a general comparison. It is true if one of the path's values fulfils it.
fn any_value(
    relation: Relation,
    path: &Path,
    literal: &Expr,
    swapped: bool,
    node: Node<'_>,
    scope: &Scope<'_, '_>,
) -> Result<bool, Clash> {
    let mut outcome = Ok(false);
    visit(path, node, scope, &mut |value| {
        outcome = one_value(relation, value.unwrap_or(""), literal, swapped);
        if matches!(outcome, Ok(false)) {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    outcome
}

fn one_value(
    relation: Relation,
    value: &str,
    literal: &Expr,
    swapped: bool,
) -> Result<bool, Clash> {
    match literal {
        Expr::Number(number) => {
            let trimmed = value.trim_matches(XML_SPACE);
            let value = is_float(trimmed, Edition::V1_1)
                .then(|| float_value(trimmed))
                .flatten()
                .ok_or(Clash)?;
            Ok(if swapped {
                relation.holds(number, &value)
            } else {
                relation.holds(&value, number)
            })
        }
        Expr::Text(text) => Ok(if swapped {
            relation.holds(&**text, value)
        } else {
            relation.holds(value, &**text)
        }),
        Expr::Bool(wanted) => match value.trim_matches(XML_SPACE) {
            "true" | "1" => Ok(relation.holds(&true, wanted)),
            "false" | "0" => Ok(relation.holds(&false, wanted)),
            _ => Err(Clash),
        },
        _ => Err(Clash),
    }
}

impl Relation {
    fn holds<T: PartialOrd + ?Sized>(self, left: &T, right: &T) -> bool {
        match self {
            Relation::Equal => left == right,
            Relation::NotEqual => left != right,
            Relation::Less => left < right,
            Relation::LessOrEqual => left <= right,
            Relation::Greater => left > right,
            Relation::GreaterOrEqual => left >= right,
        }
    }
}

fn number(expr: &Expr, node: Node<'_>, scope: &Scope<'_, '_>) -> Option<f64> {
    match expr {
        Expr::Number(number) => Some(*number),
        Expr::Count(path) => {
            let mut count = 0u32;
            visit(path, node, scope, &mut |_| {
                count += 1;
                ControlFlow::Continue(())
            });
            Some(f64::from(count))
        }
        Expr::CountDistinct(path) => {
            let mut values = HashSet::new();
            visit(path, node, scope, &mut |value| {
                values.insert(value.unwrap_or("").to_owned());
                ControlFlow::Continue(())
            });
            u32::try_from(values.len()).ok().map(f64::from)
        }
        _ => None,
    }
}

type Visitor<'v> = dyn FnMut(Option<&str>) -> ControlFlow<()> + 'v;

/// Calls `found` for each item of the path, with the value of an attribute. Returns `true` if
/// `found` stopped the walk.
fn visit(path: &Path, node: Node<'_>, scope: &Scope<'_, '_>, found: &mut Visitor<'_>) -> bool {
    visit_steps(&path.steps, path.attribute, node, scope, found).is_break()
}

fn visit_steps(
    steps: &[PathStep],
    attribute: Option<NameId>,
    node: Node<'_>,
    scope: &Scope<'_, '_>,
    found: &mut Visitor<'_>,
) -> ControlFlow<()> {
    let Some((step, rest)) = steps.split_first() else {
        let Some(wanted) = attribute else {
            return found(None);
        };
        let value = node
            .attributes()
            .find(|have| scope.name(have.name_number()) == wanted);
        return value.map_or(ControlFlow::Continue(()), |value| {
            found(Some(value.value()))
        });
    };
    let end = node.subtree_end();
    let mut next = node.index() + 1;
    while next < end {
        let Some(inner) = scope.document.node(next) else {
            break;
        };
        work::steps(1);
        if inner.is_element() && scope.name(inner.name_number()) == step.name {
            visit_steps(rest, attribute, inner, scope, found)?;
        }
        next = if step.deep {
            next + 1
        } else {
            inner.subtree_end()
        };
    }
    ControlFlow::Continue(())
}

impl Scope<'_, '_> {
    pub(crate) fn name(&self, number: u16) -> NameId {
        self.names
            .get(usize::from(number))
            .copied()
            .unwrap_or(NameId::UNKNOWN)
    }
}
