//! Costs of the shortest way to end an element. They ensure that generation ends.

use crate::model::{Content, ElementDecl, Model, Schema, TypeRef};

/// Number of elements in the smallest element of each complex type; `MAX` if it cannot end.
pub(super) struct Costs(Vec<u32>);

const ENDLESS: u32 = u32::MAX / 4;

impl Costs {
    pub(super) fn of(schema: &Schema) -> Self {
        let mut costs = Self(vec![ENDLESS; schema.complex.len()]);
        loop {
            let mut changed = false;
            for index in 0..schema.complex.len() {
                let cost = costs.content(&schema.complex[index].content);
                changed |= cost < costs.0[index];
                costs.0[index] = costs.0[index].min(cost);
            }
            if !changed {
                return costs;
            }
        }
    }

    fn content(&self, content: &Content) -> u32 {
        match content {
            Content::Empty | Content::Text(_) => 1,
            Content::Children(model) => self
                .ways(model)
                .first()
                .map_or(ENDLESS, |(cost, _)| cost.saturating_add(1)),
            Content::All(all) => {
                let needed = all
                    .members
                    .iter()
                    .enumerate()
                    .filter(|(bit, _)| all.required & (1 << bit) != 0);
                needed
                    .fold(1, |sum: u32, (_, member)| {
                        sum.saturating_add(self.element(member))
                    })
                    .min(ENDLESS)
            }
        }
    }

    fn element(&self, element: &ElementDecl) -> u32 {
        match element.ty {
            TypeRef::Complex(id) => self.0.get(id as usize).copied().unwrap_or(ENDLESS),
            _ => 1,
        }
    }

    /// Returns for each state the lowest cost to an end and the next edge (`None` to end here).
    pub(super) fn ways(&self, model: &Model) -> Vec<(u32, Option<usize>)> {
        let mut ways: Vec<(u32, Option<usize>)> = model
            .states
            .iter()
            .map(|state| (if state.accepts { 0 } else { ENDLESS }, None))
            .collect();
        loop {
            let mut changed = false;
            for state in 0..model.states.len() {
                for (index, edge) in model
                    .edges(u16::try_from(state).unwrap_or(0))
                    .iter()
                    .enumerate()
                {
                    let child = model
                        .children
                        .get(usize::from(edge.child))
                        .map_or(ENDLESS, |child| self.element(child));
                    let cost = ways[usize::from(edge.to)]
                        .0
                        .saturating_add(child)
                        .min(ENDLESS);
                    if cost < ways[state].0 {
                        ways[state] = (cost, Some(index));
                        changed = true;
                    }
                }
            }
            if !changed {
                return ways;
            }
        }
    }
}
