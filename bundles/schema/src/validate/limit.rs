//! Maximum number of children with one name in an element, computed from its automaton.

use crate::model::Model;
use crate::names::NameId;
use crate::work::steps;

/// Returns the maximum number of children with a name on any path, or `None` without a limit.
///
/// This is a longest path in a graph of strongly connected components. Tarjan's algorithm yields
/// each component after its successors. A child of that name in a component can be repeated without
/// limit.
pub(super) fn most(model: &Model, name: NameId) -> Option<u32> {
    let states = model.states.len();
    let mut search = Search {
        model,
        name,
        order: vec![UNSEEN; states],
        low: vec![UNSEEN; states],
        most: vec![None; states],
        open: Vec::new(),
        next: 0,
    };
    search.run()
}

const UNSEEN: u32 = u32::MAX;

struct Search<'m> {
    model: &'m Model,
    name: NameId,
    /// Discovery index of each state, and in `low` the smallest index that it leads back to.
    order: Vec<u32>,
    low: Vec<u32>,
    /// Result for the states of finished components.
    most: Vec<Option<u32>>,
    /// States of unfinished components.
    open: Vec<u16>,
    next: u32,
}

impl Search<'_> {
    fn run(&mut self) -> Option<u32> {
        self.see(0);
        let mut way: Vec<(u16, usize)> = vec![(0, 0)];
        while let Some((state, turn)) = way.last_mut() {
            let (state, at) = (*state, *turn);
            *turn += 1;
            steps(1);
            if let Some((to, _)) = self.step(state, at) {
                if self.order.get(usize::from(to)) == Some(&UNSEEN) {
                    self.see(to);
                    way.push((to, 0));
                } else if self.is_open(to) {
                    self.lower(state, value(&self.order, to));
                }
                continue;
            }
            way.pop();
            if let Some((before, _)) = way.last() {
                self.lower(*before, value(&self.low, state));
            }
            if value(&self.low, state) == value(&self.order, state) {
                self.close(state)?;
            }
        }
        self.most.first().copied().flatten()
    }

    /// Returns a state's step with this number: the next state, and whether it reads the name.
    fn step(&self, state: u16, number: usize) -> Option<(u16, bool)> {
        let edges = self.model.edges(state);
        if let Some(edge) = edges.get(number) {
            return Some((edge.to, edge.name == self.name));
        }
        let any = self.model.states.get(usize::from(state))?.wildcard?;
        let known = || edges.iter().any(|edge| edge.name == self.name);
        (number == edges.len()).then(|| (any, !known()))
    }

    fn see(&mut self, state: u16) {
        for numbers in [&mut self.order, &mut self.low] {
            if let Some(number) = numbers.get_mut(usize::from(state)) {
                *number = self.next;
            }
        }
        self.next += 1;
        self.open.push(state);
    }

    fn is_open(&self, state: u16) -> bool {
        self.most
            .get(usize::from(state))
            .is_some_and(Option::is_none)
    }

    fn lower(&mut self, state: u16, number: u32) {
        if let Some(low) = self.low.get_mut(usize::from(state)) {
            *low = number.min(*low);
        }
    }

    /// Finishes the component that begins here. Returns `None` if the name can be repeated in it.
    fn close(&mut self, first: u16) -> Option<()> {
        let start = self.open.iter().rposition(|state| *state == first)?;
        let knot = self.open.split_off(start);
        let mut most = 0;
        for state in &knot {
            let mut number = 0;
            while let Some((to, by_name)) = self.step(*state, number) {
                steps(1);
                number += 1;
                let beyond = self.most.get(usize::from(to)).copied().flatten();
                match beyond {
                    Some(beyond) => most = most.max(beyond + u32::from(by_name)),
                    // The target is unfinished, so it is in this component.
                    None if by_name => return None,
                    None => {}
                }
            }
        }
        for state in knot {
            if let Some(known) = self.most.get_mut(usize::from(state)) {
                *known = Some(most);
            }
        }
        Some(())
    }
}

fn value(numbers: &[u32], state: u16) -> u32 {
    numbers.get(usize::from(state)).copied().unwrap_or(UNSEEN)
}
