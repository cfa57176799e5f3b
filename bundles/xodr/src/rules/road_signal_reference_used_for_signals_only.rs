use std::collections::HashMap;

use crate::families::ids::{Class, Kind};
use crate::families::object_parts::{Stands, below};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

/// Classes that may be confused with signals. An id of these may also be the id of a signal.
const OTHERS: [Class; 4] = [
    Class::Object,
    Class::Tunnel,
    Class::Bridge,
    Class::Controller,
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(root) = map.root() else { return };
    let references: Vec<Node<'_>> = below(map, "signalReference", "signals").collect();
    if references.is_empty() {
        return;
    }
    let ids = |class| {
        let nodes = Kind::of(class).nodes(&root.document()).into_iter();
        nodes
            .filter_map(|node| Some((node.attr("id")?, node)))
            .collect::<HashMap<_, _>>()
    };
    let signals = ids(Class::Signal);
    let others = OTHERS.map(ids);
    for reference in references {
        let Some(id) = reference.attr("id").filter(|id| !signals.contains_key(id)) else {
            continue;
        };
        // Another rule reports an id that does not exist.
        let Some(target) = others.iter().find_map(|known| known.get(id)) else {
            continue;
        };
        let text = format!(
            "the signal reference refers to `{id}`, which is not a signal but an element `{}`; it must refer to \
             a signal",
            target.name()
        );
        found
            .issue(Place::attribute_or_node(reference, "id"), text)
            .stands(map, reference)
            .at(*target, "the referenced element");
    }
}
