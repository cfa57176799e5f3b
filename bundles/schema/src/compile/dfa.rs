//! Conversion of particle trees to minimal deterministic automata.
//!
//! A content model is a regular language over children, so `regex-automata` determinizes it like a
//! pattern: each child is a text of two bytes. Equivalent states are merged (Moore).

use std::collections::HashMap;

use regex_syntax::hir::{Hir, Repetition};

use super::particle::Particle;
use crate::automaton::{Automaton, MAX_MIB};
use crate::model::{Edge, ElementDecl, Model, State};

const MAX_STATES: usize = 4_096;

/// An exceeded limit: the limited item and the maximum number.
pub(super) type TooLarge = (&'static str, usize);

/// Builds the automaton of a content model.
pub(super) fn build(particle: &Particle, children: Vec<ElementDecl>) -> Result<Model, TooLarge> {
    let automaton = Automaton::new(&language(particle));
    let automaton = automaton.ok_or(("MiB for the automaton of one content model", MAX_MIB))?;
    let raw = states(&automaton, children.len())?;
    Ok(merge(&raw, children))
}

/// A symbol: a child by index, or any element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Symbol {
    Child(u16),
    Any,
}

impl Symbol {
    fn bytes(self) -> [u8; 2] {
        match self {
            Symbol::Child(index) => index.to_be_bytes(),
            // The compiler limits the number of children far below this.
            Symbol::Any => u16::MAX.to_be_bytes(),
        }
    }
}

fn language(particle: &Particle) -> Hir {
    match particle {
        Particle::Child(index) => Hir::literal(Symbol::Child(*index).bytes()),
        Particle::Any => Hir::literal(Symbol::Any.bytes()),
        Particle::Sequence(parts) => Hir::concat(parts.iter().map(language).collect()),
        Particle::Choice(parts) if parts.is_empty() => Hir::empty(),
        Particle::Choice(parts) => Hir::alternation(parts.iter().map(language).collect()),
        Particle::Repeat { what, min, max } => Hir::repetition(Repetition {
            min: *min,
            max: *max,
            greedy: true,
            sub: Box::new(language(what)),
        }),
    }
}

/// Returns the states that are reachable by whole symbols, in order of first use.
fn states(automaton: &Automaton, children: usize) -> Result<Vec<Raw>, TooLarge> {
    let children = u16::try_from(children).unwrap_or(u16::MAX);
    let symbols = || (0..children).map(Symbol::Child).chain([Symbol::Any]);
    let mut order = vec![automaton.start()];
    let mut numbers = HashMap::from([(order[0], 0)]);
    let mut raw = Vec::new();
    while let Some(&state) = order.get(raw.len()) {
        let mut edges = Vec::new();
        for symbol in symbols() {
            let Some(to) = automaton.after(state, &symbol.bytes()) else {
                continue;
            };
            let fresh = order.len();
            let number = *numbers.entry(to).or_insert(fresh);
            if number == fresh {
                order.push(to);
            }
            edges.push((symbol, number));
        }
        let accepts = automaton.accepts(state);
        raw.push(Raw { accepts, edges });
        if order.len() > MAX_STATES {
            return Err(("states in one content model", MAX_STATES));
        }
    }
    Ok(raw)
}

#[derive(Debug)]
struct Raw {
    accepts: bool,
    edges: Vec<(Symbol, usize)>,
}

/// Merges equivalent states and numbers them in order of first use.
fn merge(raw: &[Raw], children: Vec<ElementDecl>) -> Model {
    let class = classes(raw);
    let mut numbers: HashMap<usize, u16> = HashMap::new();
    let mut order = vec![0usize];
    numbers.insert(class[0], 0);
    let mut model = Model {
        children,
        ..Model::default()
    };
    let mut at = 0;
    while let Some(&state) = order.get(at) {
        let first = u32::try_from(model.edges.len()).unwrap_or(u32::MAX);
        let mut wildcard = None;
        for &(symbol, to) in &raw[state].edges {
            let fresh = u16::try_from(numbers.len()).unwrap_or(u16::MAX);
            let number = *numbers.entry(class[to]).or_insert_with(|| {
                order.push(to);
                fresh
            });
            match symbol {
                Symbol::Any => wildcard = Some(number),
                Symbol::Child(child) => {
                    let name = model.children[usize::from(child)].name;
                    model.edges.push(Edge {
                        name,
                        child,
                        to: number,
                    });
                }
            }
        }
        let count = u16::try_from(model.edges.len() - first as usize).unwrap_or(u16::MAX);
        model.states.push(State {
            first,
            count,
            accepts: raw[state].accepts,
            wildcard,
        });
        at += 1;
    }
    model
}

/// Returns the equivalence class of each state.
fn classes(raw: &[Raw]) -> Vec<usize> {
    let mut class: Vec<usize> = raw.iter().map(|state| usize::from(state.accepts)).collect();
    let mut count = 0;
    loop {
        let mut known: HashMap<(usize, Vec<(Symbol, usize)>), usize> = HashMap::new();
        let mut next = Vec::with_capacity(raw.len());
        for (index, state) in raw.iter().enumerate() {
            let edges = state
                .edges
                .iter()
                .map(|&(symbol, to)| (symbol, class[to]))
                .collect();
            let fresh = known.len();
            next.push(*known.entry((class[index], edges)).or_insert(fresh));
        }
        class = next;
        if known.len() == count {
            return class;
        }
        count = known.len();
    }
}
