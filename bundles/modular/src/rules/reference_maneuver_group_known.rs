use std::collections::{HashMap, HashSet};

use crate::assembly::{Assembly, Modular, place, say};
use crate::families::copies::short_name;
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_sdk::modular::Form;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::GroupUnknown]) {
        // The group may be missing because an inner reference leads nowhere. That is already
        // reported.
        let there = problem.target.map(|target| target.node().document());
        if !there.is_some_and(|there| is_incomplete(assembly, there)) {
            say(found, problem, "the file that is referred to");
        }
    }
    let mut finds = Finds::default();
    for problem in assembly.problems(&[What::GroupAmbiguous]) {
        if let Some(second) = problem.target {
            let there = "another group of this name";
            finds.brought(problem.at, second, there, problem.text.clone());
        }
    }
    note_nameless(assembly, &mut finds);
    finds.say(found);
    let mut said = HashSet::new();
    for reference in &assembly.expansion.references {
        let is_nameless = reference.group.attr("name").unwrap_or("").is_empty();
        if is_nameless && said.insert(reference.group) {
            say_unnamed(reference, found);
        }
    }
}

/// Checks whether a reference in a document takes fewer groups than it names.
fn is_incomplete(assembly: &Assembly<'_>, document: Document<'_>) -> bool {
    let expansion = &assembly.expansion;
    let of_it = |reference: &&Followed<'_>| {
        let piece = expansion.pieces.get(reference.piece);
        piece.is_some_and(|piece| piece.document.path() == document.path())
    };
    let is_short = |reference: &Followed<'_>| {
        let named = reference.node.children_named("ManeuverGroupReference");
        reference.target.is_none() || reference.uses.len() < named.count()
    };
    expansion.references.iter().filter(of_it).any(is_short)
}

/// Returns the references that take groups by name from files that have a group without a name.
/// Each comes with the first such group.
fn past_nameless<'a, 'd>(assembly: &'a Assembly<'d>) -> Vec<(&'a Followed<'d>, Node<'d>)> {
    // The result is cached: a file may have ten thousand references to it and as many groups.
    let mut nameless: HashMap<usize, Option<Node<'d>>> = HashMap::new();
    let all = assembly.expansion.references.iter();
    let named = all.filter(|reference| reference.form == Form::Named);
    let past = named.filter_map(|reference| {
        let target = reference.target?;
        let first = nameless.entry(target).or_insert_with(|| {
            let document = assembly.expansion.pieces.get(target)?.document;
            let mut groups = document.elements("ManeuverGroup");
            groups.find(|group| group.attr("name").is_none())
        });
        Some((reference, (*first)?))
    });
    past.collect()
}

/// Notes library files that have groups without a name, with the references to them.
fn note_nameless<'d>(assembly: &Assembly<'d>, finds: &mut Finds<'d>) {
    let mut texts: HashMap<Node<'d>, String> = HashMap::new();
    let references = past_nameless(assembly);
    // The reference tool reads the names of groups up to the one that it looks for.
    for &(reference, nameless) in &references {
        if let Some(name) = taken_after(reference, nameless) {
            texts.entry(nameless).or_insert_with(|| {
                format!(", and the reference tool fails at it before it finds `{name}`")
            });
        }
    }
    for &(reference, nameless) in &references {
        let file = short_name(nameless.document());
        let breaks_off = texts.get(&nameless).map_or("", String::as_str);
        let text = format!(
            "`{file}` has a maneuver group without a `name`, which cannot be referred to{breaks_off}"
        );
        let at = Spot::of(reference.node, "scenarioFileName");
        finds.brought(at, nameless.into(), "the group without a name", text);
    }
}

/// Returns the name of the first group after `nameless` in its file that a reference takes.
fn taken_after<'d>(reference: &Followed<'d>, nameless: Node<'d>) -> Option<&'d str> {
    let path = nameless.document().path();
    let is_after =
        |group: Node<'_>| group.document().path() == path && group.offset() > nameless.offset();
    let mut taken = reference.uses.iter().flat_map(|one| &one.copies);
    let copy = taken.find(|copy| is_after(copy.group))?;
    Some(copy.group.attr("name").unwrap_or(""))
}

/// Reports that the referring group has no name to put before the names of taken groups.
fn say_unnamed(reference: &Followed<'_>, found: &mut Sink<'_>) {
    let taken = reference.uses.iter().flat_map(|one| &one.copies).next();
    let own = taken.map(|copy| copy.group.attr("name").unwrap_or(""));
    let own = own.filter(|own| !own.is_empty()).unwrap_or("Drive");
    let lacks = match reference.group.attr("name") {
        None => "the referring group has no `name`",
        Some(_) => "the `name` of the referring group is empty",
    };
    let then = match (reference.form, reference.group.attr("name")) {
        (Form::Direct, _) => "the group that replaces it has no name either".to_owned(),
        (Form::Named, None) => format!(
            "the group that replaces it has only the name of the library's group, as `{own}`; the reference tool \
             fails at it"
        ),
        (Form::Named, Some(_)) => format!(
            "the group that replaces it has only the name of the library's group, as `{own}`; the reference tool \
             calls it `.{own}`"
        ),
    };
    let text = format!("{lacks}, so {then}; give it a name that no other group of the act has");
    let finding = found.issue(place(Spot::of(reference.group, "name")), text);
    if let Some(taken) = taken {
        finding.at(taken.group, "the group that is referred to");
    }
}
