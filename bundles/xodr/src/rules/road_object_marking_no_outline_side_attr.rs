use crate::families::corner_references::markings;
use crate::families::object_parts::{Stands, has_outline, is_blank, named};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_marking_no_outline_side_attr",
    uids: &["asam.net:xodr:1.7.0:road.object.marking.no_outline_side_attr"],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_object_marking_no_outline_side_attr.md"),
    run,
    ..Rule::DEFAULTS
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
