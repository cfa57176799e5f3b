//! Identity constraints: `key`, `unique` and `keyref` with one attribute as their field.

use crate::names::NameId;

/// Kind of a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// Values are required and must be unique.
    Key,
    /// Values are optional and must be unique.
    Unique,
    /// Values are optional and must occur in the key with this index.
    Reference(u16),
}

/// One step of a selector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A child of this name.
    Child(NameId),
    /// Any child (`*`).
    Any,
}

/// One identity constraint.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// Name of the constraint in the schema.
    pub name: Box<str>,
    /// Key, unique or reference.
    pub kind: ConstraintKind,
    /// Paths from the scope element to the selected elements.
    pub paths: Vec<Vec<Step>>,
    /// Attribute with the value.
    pub field: NameId,
}

/// Constraints of one scope element. Their selectors are merged into one tree.
#[derive(Clone, Debug, Default)]
pub struct Constraints {
    /// The constraints in order of declaration.
    pub list: Vec<Constraint>,
    tree: Vec<Branch>,
}

#[derive(Clone, Debug, Default)]
struct Branch {
    named: Vec<(NameId, u16)>,
    any: Option<u16>,
    hits: Vec<u16>,
}

impl Constraints {
    /// Merges the selectors of `list`. Returns `None` if there are more than 65,535 steps.
    pub(crate) fn new(list: Vec<Constraint>) -> Option<Self> {
        let mut all = Self {
            list,
            tree: vec![Branch::default()],
        };
        for index in 0..all.list.len() {
            let hit = u16::try_from(index).ok()?;
            for path in all.list[index].paths.clone() {
                let mut at = 0u16;
                for step in path {
                    at = all.grow(at, step)?;
                }
                all.tree[usize::from(at)].hits.push(hit);
            }
        }
        Some(all)
    }

    fn grow(&mut self, at: u16, step: Step) -> Option<u16> {
        let next = u16::try_from(self.tree.len()).ok()?;
        let branch = &mut self.tree[usize::from(at)];
        let known = match step {
            Step::Child(name) => {
                let known = branch
                    .named
                    .iter()
                    .find(|(have, _)| *have == name)
                    .map(|(_, to)| *to);
                if known.is_none() {
                    branch.named.push((name, next));
                }
                known
            }
            Step::Any => {
                let known = branch.any;
                branch.any = known.or(Some(next));
                known
            }
        };
        if known.is_none() {
            self.tree.push(Branch::default());
        }
        Some(known.unwrap_or(next))
    }

    /// Returns the branches reached from `at` by a child called `name`.
    pub(crate) fn step(&self, at: u16, name: NameId) -> impl Iterator<Item = u16> + '_ {
        let branch = self.tree.get(usize::from(at));
        let named = branch.and_then(|branch| {
            branch
                .named
                .iter()
                .find(|(have, _)| *have == name)
                .map(|(_, to)| *to)
        });
        named
            .into_iter()
            .chain(branch.and_then(|branch| branch.any))
    }

    /// Returns the constraints that select an element at branch `at`.
    pub(crate) fn hits(&self, at: u16) -> &[u16] {
        self.tree
            .get(usize::from(at))
            .map_or(&[], |branch| &branch.hits)
    }
}
