use std::collections::HashSet;

use qcbus_document::Node;
use qcbus_sdk::modular::{Followed, Problem, What};
use qcbus_sdk::{Place, Rule, Sink};

use crate::assembly::{Assembly, Modular, say};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_actor_entity_ref",
    uids: &["qcbus.dev:mosc:1.0.0:actor.entity_ref"],
    page: include_str!("actor_entity_ref.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::Actor]) {
        none(problem, found);
    }
    for reference in &assembly.expansion.references {
        let copies = || reference.uses.iter().flat_map(|one| &one.copies);
        if let Some(copy) = copies().next() {
            lost(reference, copy.group, found);
            before(reference, reference.group, found);
        }
        // What comes from further away is said where it is referred to.
        let mut seen = HashSet::new();
        let near = copies().filter(|copy| Some(copy.piece) == reference.target);
        for copy in near.filter(|copy| seen.insert(copy.group)) {
            kept(reference, copy.group, found);
            before(reference, copy.group, found);
        }
    }
}

fn actors<'d>(group: Node<'d>) -> Vec<Node<'d>> {
    let mut all = Vec::new();
    for actors in group.children_named("Actors") {
        all.extend(actors.children_named("EntityRef"));
    }
    all
}

fn first_entity<'d>(group: Node<'d>) -> Option<Node<'d>> {
    group.descendants_named("EntityRef").next()
}

fn entity<'d>(actor: Node<'d>) -> &'d str {
    actor.attr("entityRef").unwrap_or("")
}

fn name<'d>(group: Node<'d>) -> &'d str {
    group.attr("name").unwrap_or("")
}

/// A group on one side has no actor.
fn none(problem: &Problem<'_>, found: &mut Sink<'_>) {
    let finding = say(found, problem, "the group that is referred to");
    let referring = problem.at.node();
    let lacking = match actors(referring).is_empty() {
        true => referring,
        false => problem.target.map_or(referring, |target| target.node()),
    };
    if let Some(other) = first_entity(lacking) {
        finding.at(other, "what the reference tool takes for the actor instead");
    }
}

/// Actors of the referring group for whom nothing is left.
fn lost(reference: &Followed<'_>, group: Node<'_>, found: &mut Sink<'_>) {
    let all = actors(reference.group);
    let Some((first, others)) = all.split_first() else {
        return;
    };
    let Some(&second) = others.first() else {
        return;
    };
    let text = format!(
        "the group `{}` has {} actors, but only the first, `{}`, takes part in what it refers to; for {} refer to it \
         from a group of its own",
        name(reference.group),
        all.len(),
        entity(*first),
        listed(others)
    );
    let at = Place::attribute_or_node(second, "entityRef");
    found
        .issue(at, text)
        .at(group, "the group that is referred to");
}

/// Actors of the other group that stay as they are.
fn kept(reference: &Followed<'_>, group: Node<'_>, found: &mut Sink<'_>) {
    let all = actors(group);
    let Some((_, others)) = all.split_first() else {
        return;
    };
    let (Some(&second), Some(new)) = (others.first(), actors(reference.group).first().copied())
    else {
        return;
    };
    let text = format!(
        "the group `{}`, which is referred to, has {} actors, but only the first is replaced by `{}`: {} as in the \
         library; split it into groups of one actor",
        name(group),
        all.len(),
        entity(new),
        match others.len() {
            1 => format!("{} stays", listed(others)),
            _ => format!("{} stay", listed(others)),
        }
    );
    let second = Place::attribute_or_node(second, "entityRef");
    found
        .issue(reference.node, text)
        .at(second, "the actor that stays");
}

/// An entity that comes before the actors, and is taken for one by the reference tool.
fn before(reference: &Followed<'_>, group: Node<'_>, found: &mut Sink<'_>) {
    let (Some(actor), Some(first)) = (actors(group).first().copied(), first_entity(group)) else {
        return;
    };
    if first == actor {
        return;
    }
    let text = format!(
        "before its actor `{}` the group `{}` has `{}` in `{}`, which the reference tool takes for the actor, because it \
         is the first `EntityRef`; put `Actors` first",
        entity(actor),
        name(group),
        entity(first),
        first.parent().map_or("", |parent| parent.name())
    );
    let first = Place::attribute_or_node(first, "entityRef");
    found
        .issue(reference.node, text)
        .at(first, "the first `EntityRef`");
}

/// Most actors that are listed.
const MOST: usize = 3;

fn listed(actors: &[Node<'_>]) -> String {
    let names = actors.iter().take(MOST);
    let names: Vec<String> = names.map(|actor| format!("`{}`", entity(*actor))).collect();
    match actors.len() {
        0..=MOST => names.join(", "),
        _ => format!("{}, …", names.join(", ")),
    }
}
