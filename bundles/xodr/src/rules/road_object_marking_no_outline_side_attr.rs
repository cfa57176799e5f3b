use crate::families::corner_references::markings;
use crate::families::object_parts::{Stands, has_outline, is_blank, named};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for marking in markings(map) {
        if has_outline(marking.object) || !is_blank(marking.node, "side") {
            continue;
        }
        let text = format!(
            "the marking has no `side`, but {} has no outline; it must name a side of the bounding box: \
             `front`, `rear`, `left` or `right`",
            named(marking.object)
        );
        found
            .issue(Place::attribute_or_node(marking.node, "side"), text)
            .stands(map, marking.object);
    }
}
