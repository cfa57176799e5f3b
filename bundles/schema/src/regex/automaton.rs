//! Conversion of pattern trees to deterministic automata. Thompson's construction gives positions,
//! and states are sets of positions. Characters that no set of the pattern distinguishes form a
//! class.

use std::collections::{HashMap, VecDeque};

use super::charset::CharSet;
use super::parse::Tree;

const MAX_NODES: usize = 4096;
const MAX_STATES: usize = 512;
const MAX_CLASSES: usize = 250;

/// The state from which no text can match.
const DEAD: u16 = u16::MAX;

#[derive(Clone, Debug)]
pub(super) struct Automaton {
    ascii: Box<[u8; 128]>,
    /// First character of each region, with the class of the region.
    regions: Box<[(u32, u8)]>,
    classes: usize,
    steps: Box<[u16]>,
    accepts: Box<[bool]>,
}

impl Automaton {
    /// Builds the automaton, or returns the exceeded limit.
    pub(super) fn build(tree: &Tree) -> Result<Self, usize> {
        let mut nodes = Nodes::default();
        let end = nodes.push(Node::End)?;
        let start = nodes.add(tree, end)?;
        let (regions, classes) = nodes.regions()?;
        let members = nodes.members(&regions, classes);
        let (steps, accepts) = nodes.states(start, classes, &members)?;
        let mut ascii = Box::new([0u8; 128]);
        for (code, class) in ascii.iter_mut().enumerate() {
            *class = class_of(&regions, u32::try_from(code).unwrap_or(0));
        }
        Ok(Self {
            ascii,
            regions: regions.into(),
            classes,
            steps: steps.into(),
            accepts: accepts.into(),
        })
    }

    pub(super) fn matches(&self, text: &str) -> bool {
        let mut state = 0u16;
        for c in text.chars() {
            let class = match self.ascii.get(c as usize) {
                Some(&class) => class,
                None => class_of(&self.regions, c as u32),
            };
            state = self.steps[usize::from(state) * self.classes + usize::from(class)];
            if state == DEAD {
                return false;
            }
        }
        self.accepts[usize::from(state)]
    }

    pub(super) fn heap_bytes(&self) -> usize {
        128 + self.regions.len() * 8 + self.steps.len() * 2 + self.accepts.len()
    }

    /// Finds a shortest match by breadth-first search.
    pub(super) fn example(&self) -> Option<String> {
        let mut came: HashMap<u16, (u16, u8)> = HashMap::new();
        let mut queue = VecDeque::from([0u16]);
        while let Some(state) = queue.pop_front() {
            if self.accepts[usize::from(state)] {
                return Some(self.spell(state, &came));
            }
            for class in 0..self.classes {
                let to = self.steps[usize::from(state) * self.classes + class];
                if to != DEAD && to != 0 && !came.contains_key(&to) {
                    came.insert(to, (state, u8::try_from(class).unwrap_or(0)));
                    queue.push_back(to);
                }
            }
        }
        None
    }

    fn spell(&self, mut state: u16, came: &HashMap<u16, (u16, u8)>) -> String {
        let mut letters = Vec::new();
        while let Some(&(from, class)) = came.get(&state) {
            let printable = (0x21..0x7F_u8)
                .find(|&code| self.ascii[usize::from(code)] == class)
                .map(char::from);
            let any = self
                .regions
                .iter()
                .find(|region| region.1 == class)
                .and_then(|region| char::from_u32(region.0));
            letters.extend(printable.or(any));
            state = from;
        }
        letters.iter().rev().collect()
    }
}

fn class_of(regions: &[(u32, u8)], code: u32) -> u8 {
    let after = regions.partition_point(|region| region.0 <= code);
    after.checked_sub(1).map_or(0, |index| regions[index].1)
}

#[derive(Debug)]
enum Node {
    End,
    Set(usize, usize),
    Split(Vec<usize>),
}

#[derive(Default)]
struct Nodes {
    nodes: Vec<Node>,
    sets: Vec<CharSet>,
}

impl Nodes {
    fn push(&mut self, node: Node) -> Result<usize, usize> {
        if self.nodes.len() >= MAX_NODES {
            return Err(MAX_NODES);
        }
        self.nodes.push(node);
        Ok(self.nodes.len() - 1)
    }

    /// Adds `tree` with `next` as its successor and returns its first node.
    fn add(&mut self, tree: &Tree, next: usize) -> Result<usize, usize> {
        match tree {
            Tree::Set(set) => {
                let known = self.sets.iter().position(|have| have == set);
                let index = known.unwrap_or_else(|| {
                    self.sets.push(set.clone());
                    self.sets.len() - 1
                });
                self.push(Node::Set(index, next))
            }
            Tree::Sequence(parts) => parts
                .iter()
                .rev()
                .try_fold(next, |next, part| self.add(part, next)),
            Tree::Choice(branches) => {
                let starts = branches
                    .iter()
                    .map(|branch| self.add(branch, next))
                    .collect::<Result<_, _>>()?;
                self.push(Node::Split(starts))
            }
            Tree::Repeat { what, min, max } => self.add_repeat(what, *min, *max, next),
        }
    }

    fn add_repeat(
        &mut self,
        what: &Tree,
        min: u32,
        max: Option<u32>,
        next: usize,
    ) -> Result<usize, usize> {
        let mut start = next;
        match max {
            None => {
                let fork = self.push(Node::Split(vec![next]))?;
                let again = self.add(what, fork)?;
                if let Node::Split(ways) = &mut self.nodes[fork] {
                    ways.push(again);
                }
                start = fork;
            }
            Some(max) => {
                for _ in min..max {
                    let inner = self.add(what, start)?;
                    start = self.push(Node::Split(vec![inner, next]))?;
                }
            }
        }
        for _ in 0..min {
            let inner = self.add(what, start)?;
            if inner == start {
                // An empty body adds no node, so the limit on nodes would not end nested repeats of
                // it.
                break;
            }
            start = inner;
        }
        Ok(start)
    }

    /// Splits the code space at the borders of all sets. Regions in the same sets share a class.
    fn regions(&self) -> Result<(Vec<(u32, u8)>, usize), usize> {
        let mut cuts: Vec<u32> = vec![0];
        for &(first, last) in self.sets.iter().flat_map(CharSet::ranges) {
            cuts.extend([first, last + 1]);
        }
        cuts.sort_unstable();
        cuts.dedup();
        let mut known: HashMap<Vec<bool>, u8> = HashMap::new();
        let mut regions = Vec::with_capacity(cuts.len());
        for cut in cuts {
            let signature: Vec<bool> = self.sets.iter().map(|set| contains(set, cut)).collect();
            let fresh = known.len();
            if fresh >= MAX_CLASSES && !known.contains_key(&signature) {
                return Err(MAX_CLASSES);
            }
            let class = *known
                .entry(signature)
                .or_insert(u8::try_from(fresh).unwrap_or(u8::MAX));
            regions.push((cut, class));
        }
        Ok((regions, known.len()))
    }

    /// Returns for each set the classes that it contains.
    fn members(&self, regions: &[(u32, u8)], classes: usize) -> Vec<Vec<bool>> {
        let mut members = vec![vec![false; classes]; self.sets.len()];
        for (set, row) in self.sets.iter().zip(&mut members) {
            for &(first, class) in regions {
                row[usize::from(class)] |= contains(set, first);
            }
        }
        members
    }

    fn states(
        &self,
        start: usize,
        classes: usize,
        members: &[Vec<bool>],
    ) -> Result<(Vec<u16>, Vec<bool>), usize> {
        let mut known: HashMap<Vec<usize>, u16> = HashMap::new();
        let mut list = vec![self.closure(&[start])];
        known.insert(list[0].clone(), 0);
        let (mut steps, mut accepts) = (Vec::new(), Vec::new());
        let mut at = 0;
        while let Some(state) = list.get(at).cloned() {
            accepts.push(
                state
                    .iter()
                    .any(|&node| matches!(self.nodes[node], Node::End)),
            );
            for class in 0..classes {
                let to = self.closure(&self.after(&state, class, members));
                if to.is_empty() {
                    steps.push(DEAD);
                    continue;
                }
                let fresh = u16::try_from(list.len()).unwrap_or(DEAD);
                let id = *known.entry(to.clone()).or_insert(fresh);
                if id == fresh {
                    list.push(to);
                }
                steps.push(id);
            }
            at += 1;
            if list.len() > MAX_STATES {
                return Err(MAX_STATES);
            }
        }
        Ok((steps, accepts))
    }

    fn after(&self, state: &[usize], class: usize, members: &[Vec<bool>]) -> Vec<usize> {
        let step = |&node: &usize| match self.nodes[node] {
            Node::Set(set, next) if members[set][class] => Some(next),
            _ => None,
        };
        state.iter().filter_map(step).collect()
    }

    /// Returns the nodes that are reachable without reading a character, sorted and without splits.
    fn closure(&self, from: &[usize]) -> Vec<usize> {
        let mut seen = vec![false; self.nodes.len()];
        let mut stack = from.to_vec();
        let mut reached = Vec::new();
        while let Some(node) = stack.pop() {
            if std::mem::replace(&mut seen[node], true) {
                continue;
            }
            match &self.nodes[node] {
                Node::Split(ways) => stack.extend_from_slice(ways),
                _ => reached.push(node),
            }
        }
        reached.sort_unstable();
        reached
    }
}

fn contains(set: &CharSet, code: u32) -> bool {
    let after = set.ranges().partition_point(|range| range.0 <= code);
    after
        .checked_sub(1)
        .is_some_and(|index| set.ranges()[index].1 >= code)
}
