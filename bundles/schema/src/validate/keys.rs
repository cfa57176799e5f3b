//! Keys and references, collected during the walk.
//!
//! Each open element stores its positions in the selectors of the enclosing scopes. Most elements
//! have none, which costs nothing. Values are compared as values of their types.

use foldhash::HashSet;
use qcbus_document::{Attribute, Node};
use std::borrow::Cow;

use super::names::{AttributeName, NameMap};
use super::reporter::Reporter;
use super::types::Kind;
use super::wording;
use crate::constraint::{ConstraintKind, Constraints};
use crate::model::Schema;
use crate::names::NameId;
use crate::simple::{Digits, Order, Variety, XML_SPACE, float_value, is_decimal};
use crate::violation::Code;
use crate::work::steps;

/// Maximum capacity of key sets that are reused.
const SMALL_SET: usize = 64;

/// A key's value in the value space of its type.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum KeyValue<'a> {
    Text(Cow<'a, str>),
    Decimal(Digits<'a>),
    Float(u64),
    Boolean(bool),
}

/// Position of an element in the selectors of one scope.
#[derive(Clone, Copy, Debug)]
struct Active {
    scope: usize,
    branch: u16,
}

#[derive(Debug)]
struct Scope<'a, 's> {
    constraints: &'s Constraints,
    values: HashSet<(u16, KeyValue<'a>)>,
    references: Vec<(u16, KeyValue<'a>, Attribute<'a>)>,
}

/// State that an open element restores when it closes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mark {
    from: usize,
    before: usize,
    scope: bool,
}

#[derive(Debug, Default)]
pub(super) struct Keys<'a, 's> {
    active: Vec<Active>,
    /// Index of the first entry of the innermost open element.
    from: usize,
    scopes: Vec<Scope<'a, 's>>,
    /// Closed scopes, stored to reuse their memory.
    spare: Vec<Scope<'a, 's>>,
}

/// Input for opening an element.
pub(super) struct Opening<'a, 's, 'm> {
    pub(super) node: Node<'a>,
    pub(super) name: NameId,
    pub(super) kind: Kind<'s>,
    pub(super) constraints: Option<&'s Constraints>,
    pub(super) schema: &'s Schema,
    pub(super) names: &'m NameMap,
}

impl<'a, 's> Keys<'a, 's> {
    pub(super) fn enter(
        &mut self,
        opening: &Opening<'a, 's, '_>,
        reporter: &mut Reporter<'a, 's>,
    ) -> Mark {
        let mark = Mark {
            from: self.active.len(),
            before: self.from,
            scope: opening.constraints.is_some(),
        };
        for index in self.from..mark.from {
            steps(1);
            let Active { scope, branch } = self.active[index];
            let constraints = self.scopes[scope].constraints;
            for next in constraints.step(branch, opening.name) {
                self.active.push(Active {
                    scope,
                    branch: next,
                });
                self.select(scope, constraints.hits(next), opening, reporter);
            }
        }
        if let Some(constraints) = opening.constraints {
            self.active.push(Active {
                scope: self.scopes.len(),
                branch: 0,
            });
            let fresh = || Scope {
                constraints,
                values: HashSet::default(),
                references: Vec::new(),
            };
            let mut scope = self.spare.pop().unwrap_or_else(fresh);
            scope.constraints = constraints;
            self.scopes.push(scope);
            self.select(
                self.scopes.len() - 1,
                constraints.hits(0),
                opening,
                reporter,
            );
        }
        self.from = mark.from;
        mark
    }

    pub(super) fn leave(&mut self, mark: Mark, schema: &Schema, reporter: &mut Reporter<'a, 's>) {
        self.active.truncate(mark.from);
        self.from = mark.before;
        if !mark.scope {
            return;
        }
        let Some(mut scope) = self.scopes.pop() else {
            return;
        };
        for (index, value, attribute) in scope.references.drain(..) {
            let Some(constraint) = scope.constraints.list.get(usize::from(index)) else {
                continue;
            };
            let ConstraintKind::Reference(to) = constraint.kind else {
                continue;
            };
            let wanted = (to, value);
            if !scope.values.contains(&wanted) {
                let key = (std::ptr::from_ref(constraint) as usize, 0);
                reporter.add_at(
                    Code::DanglingReference,
                    key,
                    attribute.node(),
                    Some(attribute),
                    || {
                        let key = scope.constraints.list.get(usize::from(to));
                        wording::dangling(attribute, key, schema)
                    },
                );
            }
        }
        // Clearing a set costs its capacity. A large one is dropped: the next scope may be small.
        if scope.values.capacity() > SMALL_SET {
            scope.values = HashSet::default();
        }
        steps(scope.values.capacity());
        scope.values.clear();
        self.spare.push(scope);
    }

    fn select(
        &mut self,
        scope: usize,
        hits: &[u16],
        opening: &Opening<'a, 's, '_>,
        reporter: &mut Reporter<'a, 's>,
    ) {
        for &index in hits {
            steps(1);
            let scope = &mut self.scopes[scope];
            let Some(constraint) = scope.constraints.list.get(usize::from(index)) else {
                continue;
            };
            let place = std::ptr::from_ref(constraint) as usize;
            let Some(attribute) = opening.attribute(constraint.field) else {
                if constraint.kind == ConstraintKind::Key {
                    let field = opening.schema.names.text(constraint.field);
                    reporter.add(Code::MissingKey, (place, 0), opening.node, || {
                        wording::missing_key(opening.node, field, &constraint.name)
                    });
                }
                continue;
            };
            let value = opening.value(attribute, constraint.field);
            if let ConstraintKind::Reference(_) = constraint.kind {
                scope.references.push((index, value, attribute));
            } else if !scope.values.insert((index, value)) {
                reporter.add_at(
                    Code::DuplicateKey,
                    (place, 0),
                    opening.node,
                    Some(attribute),
                    || wording::duplicate(attribute, &constraint.name),
                );
            }
        }
    }
}

impl<'a> Opening<'a, '_, '_> {
    fn attribute(&self, field: NameId) -> Option<Attribute<'a>> {
        self.node
            .attributes()
            .find(|one| self.names.attribute(*one) == AttributeName::Plain(field))
    }

    fn value(&self, attribute: Attribute<'a>, field: NameId) -> KeyValue<'a> {
        let declared = match self.kind {
            Kind::Complex(_, ty) => ty.attribute(field),
            Kind::Simple(_) => None,
        };
        let ty = declared.and_then(|declared| self.schema.simple.get(declared.value as usize));
        let text = attribute.value();
        let Some((ty, Variety::Atomic(builtin))) = ty.map(|ty| (ty, &ty.variety)) else {
            return KeyValue::Text(Cow::Borrowed(text));
        };
        let trimmed = text.trim_matches(XML_SPACE);
        match builtin.order() {
            Order::Text => KeyValue::Text(ty.normalized(*builtin, text)),
            Order::Decimal if is_decimal(trimmed) => KeyValue::Decimal(Digits::of(trimmed)),
            Order::Boolean => KeyValue::Boolean(matches!(trimmed, "true" | "1")),
            Order::Float => match float_value(trimmed) {
                // Minus zero equals zero.
                Some(value) => KeyValue::Float((value + 0.0).to_bits()),
                None => KeyValue::Text(Cow::Borrowed(text)),
            },
            Order::Decimal => KeyValue::Text(Cow::Borrowed(text)),
        }
    }
}
