//! Shortest paths through content models, to find the children that are missing.

use std::collections::{HashSet, VecDeque};

use crate::model::Model;
use crate::names::NameId;
use crate::work::steps;

/// Maximum number of visited states in the search for an expected child.
const MAX_SEARCH: usize = 256;

/// A path through a model: the target state and the skipped children.
pub(super) type Way = (u16, Vec<NameId>);

/// Returns the shortest path from `state` to a target that `found` accepts. The target is an edge
/// with a child's name, or a state with the flag whether the element may end there.
pub(super) fn way_to(
    model: &Model,
    state: u16,
    found: impl Fn(Option<NameId>, bool) -> bool,
) -> Option<Way> {
    way_without(model, state, None, &found)
}

/// Returns the skipped children that are on every path. These are certainly missing.
pub(super) fn needed(
    model: &Model,
    state: u16,
    skipped: &[NameId],
    found: impl Fn(Option<NameId>, bool) -> bool,
) -> Vec<NameId> {
    let only_way = |name: &&NameId| way_without(model, state, Some(**name), &found).is_none();
    skipped.iter().filter(only_way).copied().collect()
}

fn way_without(
    model: &Model,
    state: u16,
    avoided: Option<NameId>,
    found: &impl Fn(Option<NameId>, bool) -> bool,
) -> Option<Way> {
    let mut visited = HashSet::from([state]);
    let mut queue = VecDeque::from([(state, Vec::new())]);
    while let Some((at, path)) = queue.pop_front() {
        let edges = model.edges(at);
        steps(1 + 2 * edges.len() + path.len());
        if let Some(edge) = edges.iter().find(|edge| found(Some(edge.name), false)) {
            return Some((edge.to, path));
        }
        let accepts = model
            .states
            .get(usize::from(at))
            .is_some_and(|row| row.accepts);
        if !path.is_empty() && found(None, accepts) {
            return Some((at, path));
        }
        for edge in edges.iter().filter(|edge| Some(edge.name) != avoided) {
            if visited.len() < MAX_SEARCH && visited.insert(edge.to) {
                let mut longer = path.clone();
                longer.push(edge.name);
                queue.push_back((edge.to, longer));
            }
        }
    }
    None
}
