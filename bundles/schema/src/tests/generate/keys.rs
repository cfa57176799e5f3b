//! Keys and references of generated documents.

use super::Tree;
use crate::constraint::{Constraint, ConstraintKind, Constraints, Step};
use crate::model::Schema;

/// Makes keys unique and points references at existing keys. Returns `false` if a required
/// reference has no target.
pub(super) fn settle<'s>(tree: &mut Tree<'s>, schema: &'s Schema) -> bool {
    let mut settled = true;
    for child in &mut tree.children {
        settled &= settle(child, schema);
    }
    let Some(constraints) = tree.declared.constraints.as_deref() else {
        return settled;
    };
    let mut next = 1_000;
    for constraint in &constraints.list {
        if !matches!(constraint.kind, ConstraintKind::Reference(_)) {
            unique(tree, constraint, &mut next, schema);
        }
    }
    for constraint in &constraints.list {
        if let ConstraintKind::Reference(to) = constraint.kind {
            settled &= refer(tree, constraint, constraints, to);
        }
    }
    settled
}

fn unique<'s>(tree: &mut Tree<'s>, constraint: &Constraint, next: &mut u32, schema: &'s Schema) {
    let mut seen = std::collections::HashSet::new();
    let key = constraint.kind == ConstraintKind::Key;
    for path in &constraint.paths {
        select(tree, path, &mut |found| {
            let Some(at) = found
                .attributes
                .iter()
                .position(|have| have.0 == constraint.field)
            else {
                if key {
                    *next += 1;
                    let name = schema.names.text(constraint.field);
                    found
                        .attributes
                        .push((constraint.field, name, next.to_string(), true));
                }
                return true;
            };
            let value = &mut found.attributes[at].2;
            if value != "0" {
                *next += 1;
                *value = if value.starts_with('-') {
                    format!("-{next}")
                } else {
                    next.to_string()
                };
            }
            seen.insert(value.clone())
        });
    }
}

fn refer(tree: &mut Tree<'_>, constraint: &Constraint, all: &Constraints, to: u16) -> bool {
    let Some(key) = all.list.get(usize::from(to)) else {
        return false;
    };
    let mut values = Vec::new();
    for path in &key.paths {
        select(tree, path, &mut |found| {
            values.extend(
                found
                    .attributes
                    .iter()
                    .find(|have| have.0 == key.field)
                    .map(|have| have.2.clone()),
            );
            true
        });
    }
    let mut turn = 0;
    let mut settled = true;
    for path in &constraint.paths {
        select(tree, path, &mut |found| {
            let Some(at) = found
                .attributes
                .iter()
                .position(|have| have.0 == constraint.field)
            else {
                return true;
            };
            if values.is_empty() {
                if found.attributes[at].3 {
                    settled = false;
                    return true;
                }
                found.attributes.remove(at);
                return true;
            }
            found.attributes[at]
                .2
                .clone_from(&values[turn % values.len()]);
            turn += 1;
            true
        });
    }
    settled
}

/// Calls `keep` for the elements of a path and removes those for which it returns `false`.
fn select<'s>(tree: &mut Tree<'s>, path: &[Step], keep: &mut dyn FnMut(&mut Tree<'s>) -> bool) {
    let Some((step, rest)) = path.split_first() else {
        return;
    };
    tree.children.retain_mut(|child| {
        let fits = match step {
            Step::Any => true,
            Step::Child(name) => child.declared.name == *name,
        };
        match (fits, rest.is_empty()) {
            (false, _) => true,
            (true, true) => keep(child),
            (true, false) => {
                select(child, rest, keep);
                true
            }
        }
    });
}
