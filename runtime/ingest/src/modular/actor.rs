//! For whom the maneuvers of a group are.

use qcbus_document::{Attribute, Node};

use super::copy::{Copy, Value};
use super::problem::{Problem, Problems, Spot, What};

/// The actors of a group.
pub(super) fn actors<'d>(group: Node<'d>) -> impl Iterator<Item = Node<'d>> {
    let all = group.children_named("Actors").collect::<Vec<_>>();
    all.into_iter()
        .flat_map(|actors| actors.children_named("EntityRef").collect::<Vec<_>>())
}

fn entity<'d>(group: Node<'d>) -> Option<Attribute<'d>> {
    actors(group).next()?.attribute("entityRef")
}

/// Puts the first actor of the referring group in the place of the first actor of the copied one.
pub(super) fn replace<'d>(
    copy: &mut Copy<'d>,
    part: usize,
    referring: Node<'d>,
    problems: &mut Problems<'d>,
) {
    let quoted = |group: Node<'_>| group.attr("name").unwrap_or("").to_owned();
    let mut lacks = |group: Node<'d>, other: Node<'d>, what: &str| {
        let text = format!(
            "the {what} `{}` names no actor (`Actors/EntityRef`), so nobody knows for whom the maneuvers are",
            quoted(group)
        );
        problems.push(Problem {
            what: What::Actor,
            at: Spot::Node(referring),
            target: Some(Spot::Node(if group == referring { other } else { group })),
            text,
        });
    };
    match (entity(referring), entity(copy.group)) {
        (Some(new), Some(old)) => {
            copy.edits.insert(old.offset(), Value::of(part, new));
        }
        (None, _) => lacks(referring, copy.group, "referring group"),
        (_, None) => lacks(copy.group, referring, "group that is referred to,"),
    }
}
