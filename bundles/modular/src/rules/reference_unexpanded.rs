use std::collections::{HashMap, HashSet};

use crate::assembly::{Assembly, Modular};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_sdk::modular::Form;
use qcbus_sdk::modular::is_archive;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut finds = Finds::default();
    let mut referring: HashMap<usize, Vec<Node<'_>>> = HashMap::new();
    for reference in &assembly.expansion.references {
        let Some(target) = reference.target else {
            continue;
        };
        let document = assembly
            .expansion
            .pieces
            .get(target)
            .map(|piece| piece.document);
        let Some(document) = document.filter(|document| !is_archive(*document)) else {
            continue;
        };
        let groups = referring.entry(target).or_insert_with(|| {
            let refers = |group: &Node<'_>| group.child("ScenarioReference").is_some();
            let groups = document.elements("ManeuverGroup");
            groups.filter(refers).collect()
        });
        if groups.is_empty() {
            continue;
        }
        let taken = taken(assembly, reference, target);
        for &group in groups.iter() {
            let is_taken = match reference.form {
                Form::Direct => true,
                Form::Named => taken.contains(&group),
            };
            if is_taken {
                note(reference, document, group, &mut finds);
            }
        }
    }
    finds.say(found);
}

/// Returns the referring groups of the target that the reference takes. A group counts if its own
/// name is listed, or the name of a group that replaces it.
fn taken<'d>(
    assembly: &Assembly<'d>,
    reference: &Followed<'d>,
    target: usize,
) -> HashSet<Node<'d>> {
    let named = reference.node.children_named("ManeuverGroupReference");
    let names: HashSet<&str> = named
        .filter_map(|node| node.attr("maneuverGroupName"))
        .collect();
    let inner = assembly.expansion.references.iter();
    let inner = inner.filter(|inner| inner.piece == target);
    let is_named = |inner: &&Followed<'d>| {
        let mut copies = inner.uses.iter().flat_map(|one| &one.copies);
        inner
            .group
            .attr("name")
            .is_some_and(|name| names.contains(name))
            || copies.any(|copy| names.contains(copy.name()))
    };
    inner.filter(is_named).map(|inner| inner.group).collect()
}

fn note<'d>(
    reference: &Followed<'d>,
    document: Document<'d>,
    group: Node<'d>,
    finds: &mut Finds<'d>,
) {
    let path = document.path();
    let file = path.rsplit(['/', '!']).next().unwrap_or(path);
    let text = format!(
        "the group `{}` of `{file}` refers to other groups itself, which is followed here, but not by the \
         reference tool: it expands archives only; pack `{file}` as `.mosc` and refer to that",
        group.attr("name").unwrap_or("")
    );
    let inner = group.child("ScenarioReference").unwrap_or(group);
    let at = Spot::of(reference.node, "scenarioFileName");
    finds.brought(at, inner.into(), "the reference in it", text);
}
