//! Finds and replaces the actors of a maneuver group.

use qcbus_document::{Attribute, Node};

use super::copy::{Copy, Value};
use super::problem::{Problem, Problems, Spot, What};

/// Returns the actors of a group.
pub(super) fn actors<'d>(group: Node<'d>) -> impl Iterator<Item = Node<'d>> {
    let all = group.children_named("Actors").collect::<Vec<_>>();
    all.into_iter()
        .flat_map(|actors| actors.children_named("EntityRef").collect::<Vec<_>>())
}

fn entity<'d>(group: Node<'d>) -> Option<Attribute<'d>> {
    actors(group).next()?.attribute("entityRef")
}

/// Replaces the first actor of the copied group by the first actor of the referring group.
pub(super) fn replace<'d>(
    copy: &mut Copy<'d>,
    piece: usize,
    referring: Node<'d>,
    problems: &mut Problems<'d>,
) {
    let library = copy.group;
    let mut lacks = |group: Node<'_>, what: &str, then: &str| {
        let name = group.attr("name").unwrap_or("");
        problems.push(Problem {
            what: What::Actor,
            at: Spot::Node(referring),
            target: Some(Spot::Node(library)),
            text: format!("the group `{name}`{what} has no actor (`Actors/EntityRef`), so {then}"),
        });
    };
    match (entity(referring), entity(copy.group)) {
        (Some(new), Some(old)) => {
            copy.edits.insert(old.offset(), Value::of(piece, new));
        }
        (None, _) => lacks(
            referring,
            "",
            "the actor of the maneuvers that it refers to is undefined",
        ),
        (_, None) => lacks(
            library,
            ", which is referred to,",
            "there is none that the actor of the referring group could replace",
        ),
    }
}
