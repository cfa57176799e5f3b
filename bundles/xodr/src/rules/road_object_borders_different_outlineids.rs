use std::collections::HashMap;

use crate::families::object_parts::{Stands, below, owner};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for list in below(map, "outlines", "object") {
        let mut seen: HashMap<&str, Node<'_>> = HashMap::new();
        for outline in list.children_named("outline") {
            let Some(id) = outline.attr("id") else {
                continue;
            };
            let Some(first) = seen.get(id) else {
                seen.insert(id, outline);
                continue;
            };
            let text = format!(
                "the outline id `{id}` occurs twice in this object; a border that refers to it is ambiguous"
            );
            found
                .issue(Place::attribute_or_node(outline, "id"), text)
                .stands(map, owner(list))
                .at(*first, "the first outline with this id");
        }
        borders_need_ids(map, list, found);
    }
}

/// Reports outlines without ids. Borders cannot refer to one of several such outlines.
fn borders_need_ids<'a>(map: &RoadMap<'a>, list: Node<'a>, found: &mut Sink<'_>) {
    let object = owner(list);
    let Some(borders) = object.child("borders") else {
        return;
    };
    if list.children_named("outline").nth(1).is_none() {
        return;
    }
    let nameless = list
        .children_named("outline")
        .filter(|outline| outline.attr("id").is_none());
    for outline in nameless {
        let text = "the outline has no `id`; if there are several outlines, each one needs its own, so that \
                    borders can refer to it";
        found
            .issue(outline, text)
            .level(Level::Warning)
            .stands(map, object)
            .at(borders, "the borders");
    }
}
