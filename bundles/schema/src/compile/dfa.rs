//! Conversion of particle trees to minimal deterministic automata.
//!
//! Glushkov's construction gives every occurrence of a child a position and lists the positions
//! that may follow it. The states are sets of positions. Equivalent states are merged (Moore).

use std::collections::{BTreeMap, HashMap};

use super::particle::Particle;
use crate::model::{Edge, ElementDecl, Model, State};

const MAX_POSITIONS: usize = 4_096;
const MAX_FOLLOWS: usize = 500_000;
const MAX_STATES: usize = 2_048;

/// An exceeded limit: the limited item and the maximum number.
pub(super) type TooLarge = (&'static str, usize);

/// Builds the automaton of a content model.
pub(super) fn build(particle: &Particle, children: Vec<ElementDecl>) -> Result<Model, TooLarge> {
    let mut positions = Positions::default();
    let whole = positions.add(particle)?;
    let raw = positions.states(&whole)?;
    Ok(merge(&raw, children))
}

/// A symbol: a child by index, or any element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Symbol {
    Child(u16),
    Any,
}

#[derive(Debug)]
struct Fragment {
    nullable: bool,
    first: Vec<u32>,
    last: Vec<u32>,
}

impl Fragment {
    fn empty() -> Self {
        Self {
            nullable: true,
            first: Vec::new(),
            last: Vec::new(),
        }
    }
}

#[derive(Default)]
struct Positions {
    symbols: Vec<Symbol>,
    follow: Vec<Vec<u32>>,
    follows: usize,
}

impl Positions {
    fn add(&mut self, particle: &Particle) -> Result<Fragment, TooLarge> {
        match particle {
            Particle::Child(index) => self.position(Symbol::Child(*index)),
            Particle::Any => self.position(Symbol::Any),
            Particle::Sequence(parts) => {
                parts.iter().try_fold(Fragment::empty(), |before, part| {
                    let part = self.add(part)?;
                    self.join(before, part)
                })
            }
            Particle::Choice(parts) if parts.is_empty() => Ok(Fragment::empty()),
            Particle::Choice(parts) => {
                let mut whole = Fragment {
                    nullable: false,
                    first: Vec::new(),
                    last: Vec::new(),
                };
                for part in parts {
                    let part = self.add(part)?;
                    whole.nullable |= part.nullable;
                    whole.first.extend(part.first);
                    whole.last.extend(part.last);
                }
                Ok(whole)
            }
            Particle::Repeat { what, min, max } => self.repeat(what, *min, *max),
        }
    }

    fn position(&mut self, symbol: Symbol) -> Result<Fragment, TooLarge> {
        if self.symbols.len() >= MAX_POSITIONS {
            return Err(("positions in one content model", MAX_POSITIONS));
        }
        let at = u32::try_from(self.symbols.len()).unwrap_or(u32::MAX);
        self.symbols.push(symbol);
        self.follow.push(Vec::new());
        Ok(Fragment {
            nullable: false,
            first: vec![at],
            last: vec![at],
        })
    }

    fn connect(&mut self, from: &[u32], to: &[u32]) -> Result<(), TooLarge> {
        for &position in from {
            self.follow[position as usize].extend_from_slice(to);
        }
        self.follows += from.len() * to.len();
        if self.follows > MAX_FOLLOWS {
            Err(("transitions in one content model", MAX_FOLLOWS))
        } else {
            Ok(())
        }
    }

    fn join(&mut self, mut before: Fragment, after: Fragment) -> Result<Fragment, TooLarge> {
        self.connect(&before.last, &after.first)?;
        if before.nullable {
            before.first.extend_from_slice(&after.first);
        }
        let mut last = after.last;
        if after.nullable {
            last.extend(before.last);
        }
        Ok(Fragment {
            nullable: before.nullable && after.nullable,
            first: before.first,
            last,
        })
    }

    fn repeat(
        &mut self,
        what: &Particle,
        min: u32,
        max: Option<u32>,
    ) -> Result<Fragment, TooLarge> {
        let mut tail = match max {
            None => {
                let turns = self.add(what)?;
                self.connect(&turns.last, &turns.first)?;
                Fragment {
                    nullable: turns.nullable || min == 0,
                    ..turns
                }
            }
            Some(max) => {
                let mut optional = Fragment::empty();
                for _ in min..max {
                    let once = self.add(what)?;
                    optional = self.join(once, optional)?;
                    optional.nullable = true;
                    if optional.last.is_empty() {
                        break; // an empty body stays empty, so further repetitions change nothing
                    }
                }
                optional
            }
        };
        let needed = if max.is_none() {
            min.saturating_sub(1)
        } else {
            min
        };
        for _ in 0..needed {
            let once = self.add(what)?;
            if once.last.is_empty() {
                break;
            }
            tail = self.join(once, tail)?;
        }
        Ok(tail)
    }

    /// Runs the subset construction. A named child takes precedence over a wildcard.
    fn states(&self, whole: &Fragment) -> Result<Vec<Raw>, TooLarge> {
        let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
        let mut sets: Vec<Vec<u32>> = vec![Vec::new()];
        let is_last: Vec<bool> = {
            let mut flags = vec![false; self.symbols.len()];
            whole
                .last
                .iter()
                .for_each(|&position| flags[position as usize] = true);
            flags
        };
        let mut raw = Vec::new();
        while let Some(set) = sets.get(raw.len()).cloned() {
            let start = raw.is_empty();
            let accepts = if start {
                whole.nullable
            } else {
                set.iter().any(|&position| is_last[position as usize])
            };
            let next = if start {
                self.by_symbol(&whole.first)
            } else {
                self.by_symbol(&self.following(&set))
            };
            let mut edges = Vec::with_capacity(next.len());
            for (symbol, target) in next {
                let fresh = sets.len();
                let id = *known.entry(target.clone()).or_insert(fresh);
                if id == fresh {
                    sets.push(target);
                }
                edges.push((symbol, id));
            }
            raw.push(Raw { accepts, edges });
            if sets.len() > MAX_STATES {
                return Err(("states in one content model", MAX_STATES));
            }
        }
        Ok(raw)
    }

    fn following(&self, set: &[u32]) -> Vec<u32> {
        set.iter()
            .flat_map(|&position| self.follow[position as usize].iter().copied())
            .collect()
    }

    fn by_symbol(&self, positions: &[u32]) -> BTreeMap<Symbol, Vec<u32>> {
        let mut next: BTreeMap<Symbol, Vec<u32>> = BTreeMap::new();
        for &position in positions {
            next.entry(self.symbols[position as usize])
                .or_default()
                .push(position);
        }
        for set in next.values_mut() {
            set.sort_unstable();
            set.dedup();
        }
        next
    }
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
