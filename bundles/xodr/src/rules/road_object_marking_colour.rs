use crate::families::corner_references::markings;
use crate::families::object_parts::{Stands, is_blank};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[MARKING, IN_OUTLINE],
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

const MARKING: &str = "asam.net:xodr:1.7.0:road.object.marking.colour";
const IN_OUTLINE: &str = "asam.net:xodr:1.9.0:road.object.object_marking.colour";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for marking in markings(map) {
        if is_blank(marking.node, "color") {
            let uid = marking.outline.map_or(MARKING, |_| IN_OUTLINE);
            let text = "the marking has no `color`, but must have one";
            found
                .issue(Place::attribute_or_node(marking.node, "color"), text)
                .stands(map, marking.object)
                .uid(uid);
        }
    }
}
