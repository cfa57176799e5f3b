use std::collections::BTreeMap;

use crate::assembly::{Assembly, Modular, say};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

/// Depth up to which references are easy to follow for people.
const MODEST: usize = 8;

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut is_refused = false;
    for problem in assembly.problems(&[What::Depth]) {
        say(found, problem, "the file that is referred to");
        is_refused = true;
    }
    if is_refused {
        return;
    }
    let references = &assembly.expansion.references;
    let nexts = nexts(references);
    for (index, reference) in references.iter().enumerate() {
        if reference.piece != 0 {
            continue;
        }
        let next = |&index: &usize| nexts.get(index).copied().flatten();
        let chain: Vec<&Followed<'_>> = std::iter::successors(Some(index), next)
            .filter_map(|index| references.get(index))
            .collect();
        let Some(&deep) = chain.get(MODEST) else {
            continue;
        };
        let name = |node: Node<'_>| node.attr("scenarioFileName").unwrap_or("").to_owned();
        let names: Vec<String> = chain.iter().map(|step| name(step.node)).collect();
        let text = format!(
            "references between scenarios are {} deep from here, `{}`; more than {MODEST} levels are hard to \
             follow: refer to the inner ones directly",
            chain.len(),
            names.join("` → `")
        );
        let place = Place::attribute_or_node(reference.node, "scenarioFileName");
        let there = Place::attribute_or_node(deep.node, "scenarioFileName");
        let finding = found.issue(place, text).level(Level::Warning);
        finding.at(there, format!("the reference at depth {}", MODEST + 1));
    }
}

/// For each reference, returns the reference in its target file that leads deepest. References of a
/// file come before the references that lead to it.
fn nexts(references: &[Followed<'_>]) -> Vec<Option<usize>> {
    let mut heights: Vec<usize> = Vec::new();
    let mut nexts = Vec::new();
    let mut deepest: BTreeMap<usize, usize> = BTreeMap::new();
    for (index, reference) in references.iter().enumerate() {
        let next = reference
            .target
            .and_then(|piece| deepest.get(&piece))
            .copied();
        let below = next.and_then(|next| heights.get(next)).copied();
        let height = below.unwrap_or(0) + 1;
        heights.push(height);
        nexts.push(next);
        let best = deepest
            .get(&reference.piece)
            .and_then(|&best| heights.get(best));
        if best.is_none_or(|&best| best < height) {
            deepest.insert(reference.piece, index);
        }
    }
    nexts
}
