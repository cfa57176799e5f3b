use std::collections::HashSet;

use crate::assembly::{Assembly, Modular};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_sdk::modular::Problem;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut finds = Finds::default();
    for problem in assembly.problems(&[What::Actor]) {
        none(problem, &mut finds);
    }
    for reference in &assembly.expansion.references {
        let copies = || reference.uses.iter().flat_map(|one| &one.copies);
        if let Some(copy) = copies().next() {
            lost(reference, copy.group, found);
            before(reference, reference.group, &mut finds);
        }
        // Groups from nested references are reported at the inner reference.
        let mut seen = HashSet::new();
        let near = copies().filter(|copy| Some(copy.piece) == reference.target);
        for copy in near.filter(|copy| seen.insert(copy.group)) {
            kept(reference, copy.group, &mut finds);
            before(reference, copy.group, &mut finds);
        }
    }
    finds.say(found);
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

/// Notes a group without an actor on one side of a reference.
fn none<'d>(problem: &Problem<'d>, finds: &mut Finds<'d>) {
    let referring = problem.at.node();
    let library = problem.target.map_or(referring, |target| target.node());
    let first = actors(referring).first().copied();
    let names_one = first.is_some_and(|actor| actor.attribute("entityRef").is_some());
    let there = "the group that is referred to";
    let text = problem.text.clone();
    let (lacking, find) = match names_one {
        true => {
            let find = finds.brought(problem.at, library.into(), there, text);
            (library, find)
        }
        false => {
            let find = finds.given(problem.at, library.into(), there, text);
            (referring, find)
        }
    };
    if let (Some(find), Some(other)) = (find, first_entity(lacking)) {
        find.besides(
            other,
            "the entity that the reference tool takes as the actor instead",
        );
    }
}

/// Reports actors of the referring group that get no part in the result.
fn lost(reference: &Followed<'_>, group: Node<'_>, found: &mut Sink<'_>) {
    let all = actors(reference.group);
    let Some((first, others)) = all.split_first() else {
        return;
    };
    let Some(&second) = others.first() else {
        return;
    };
    let text = format!(
        "the group `{}` has {} actors, but only the first, `{}`, takes part in the group that it refers to; for \
         {}, refer to it from a separate group",
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

/// Notes actors of the other group that are not replaced.
fn kept<'d>(reference: &Followed<'d>, group: Node<'d>, finds: &mut Finds<'d>) {
    let all = actors(group);
    let Some((first, others)) = all.split_first() else {
        return;
    };
    let (Some(&second), false) = (others.first(), actors(reference.group).is_empty()) else {
        return;
    };
    let text = format!(
        "the group `{}`, which is referred to, has {} actors, but the actor of the referring group replaces only \
         the first, `{}`: {} as in the library; split it into groups with one actor each",
        name(group),
        all.len(),
        entity(*first),
        match others.len() {
            1 => format!("{} stays", listed(others)),
            _ => format!("{} stay", listed(others)),
        }
    );
    let second = Spot::of(second, "entityRef");
    finds.brought(
        reference.node.into(),
        second,
        "the actor that is not replaced",
        text,
    );
}

/// Notes an entity before the actors. The reference tool takes it for the actor.
fn before<'d>(reference: &Followed<'d>, group: Node<'d>, finds: &mut Finds<'d>) {
    let (Some(actor), Some(first)) = (actors(group).first().copied(), first_entity(group)) else {
        return;
    };
    if first == actor {
        return;
    }
    let text = format!(
        "before its actor `{}` the group `{}` has `{}` in `{}`, which the reference tool takes as the actor \
         because it is the first `EntityRef`; put `Actors` first",
        entity(actor),
        name(group),
        entity(first),
        first.parent().map_or("", |parent| parent.name())
    );
    let first = Spot::of(first, "entityRef");
    finds.brought(reference.node.into(), first, "the first `EntityRef`", text);
}

/// Maximum number of listed actors.
const MOST: usize = 3;

fn listed(actors: &[Node<'_>]) -> String {
    let names = actors.iter().take(MOST);
    let names: Vec<String> = names.map(|actor| format!("`{}`", entity(*actor))).collect();
    match actors.len() {
        0..=MOST => names.join(", "),
        _ => format!("{}, …", names.join(", ")),
    }
}
