use std::collections::HashSet;

use qcbus_document::{Document, Node};
use qcbus_sdk::modular::{Followed, Form, Spot, What};
use qcbus_sdk::{Rule, Sink};

use crate::assembly::{Assembly, Modular, place, say};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_reference_maneuver_group_known",
    uids: &["qcbus.dev:mosc:1.0.0:reference.maneuver_group_known"],
    page: include_str!("reference_maneuver_group_known.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::GroupUnknown]) {
        // It may be missing only for a reference in there that leads nowhere, which has been said.
        let there = problem.target.map(|target| target.node().document());
        if !there.is_some_and(|there| is_incomplete(assembly, there)) {
            say(found, problem, "the file that is referred to");
        }
    }
    for problem in assembly.problems(&[What::GroupAmbiguous]) {
        say(found, problem, "another group of this name");
    }
    let mut said = HashSet::new();
    for reference in &assembly.expansion.references {
        if let Some(nameless) = nameless(assembly, reference).filter(|&group| said.insert(group)) {
            say_nameless(reference, nameless, found);
        }
    }
}

/// Whether a reference in a document takes less than it asks for.
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

/// The first group without a name of the file that a reference takes groups from by their names.
fn nameless<'d>(assembly: &Assembly<'d>, reference: &Followed<'d>) -> Option<Node<'d>> {
    let target = reference.target.filter(|_| reference.form == Form::Named)?;
    let document = assembly.expansion.pieces.get(target)?.document;
    let mut groups = document.elements("ManeuverGroup");
    groups.find(|group| group.attr("name").is_none())
}

fn say_nameless(reference: &Followed<'_>, nameless: Node<'_>, found: &mut Sink<'_>) {
    let path = nameless.document().path();
    let file = path.rsplit('/').next().unwrap_or(path);
    // The reference tool reads the names of groups up to the one that it looks for.
    let is_after =
        |group: Node<'_>| group.document().path() == path && group.offset() > nameless.offset();
    let mut taken = reference.uses.iter().flat_map(|one| &one.copies);
    let breaks_off = match taken.find(|copy| is_after(copy.group)) {
        Some(copy) => format!(
            ", and the reference tool breaks off at it before it finds `{}`",
            copy.group.attr("name").unwrap_or("")
        ),
        None => String::new(),
    };
    let text = format!(
        "`{file}` has a maneuver group without a `name`, which cannot be referred to{breaks_off}"
    );
    let at = place(Spot::of(reference.node, "scenarioFileName"));
    found
        .issue(at, text)
        .at(nameless, "the group without a name");
}
