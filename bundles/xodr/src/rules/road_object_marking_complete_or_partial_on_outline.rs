use crate::families::corner_references::markings;
use crate::families::object_parts::{Stands, corners, named, outlines};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for marking in markings(map) {
        let Some(own) = marking.outline else {
            continue;
        };
        for reference in marking.references() {
            let Some(id) = reference.attr("id") else {
                continue;
            };
            if point(own, id).is_some() {
                continue;
            }
            let foreign = outlines(marking.object).find_map(|outline| point(outline, id));
            if let Some(foreign) = foreign {
                let text = format!(
                    "the marking refers to the point `{id}`, which belongs to another outline of {}; a marking \
                     must lie on the outline in which it is defined",
                    named(marking.object)
                );
                found
                    .issue(Place::attribute_or_node(reference, "id"), text)
                    .stands(map, marking.object)
                    .at(foreign, "the point of the other outline");
            }
        }
    }
}

fn point<'a>(outline: Node<'a>, id: &str) -> Option<Node<'a>> {
    corners(outline).find(|point| point.attr("id") == Some(id))
}
