use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_lane_section_single_side",
    uids: &["qcbus.dev:xodr:1.4.0:lane_section.single_side"],
    level: Level::Warning,
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("lane_section_single_side.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        let node = section.node();
        let has_lanes = |side: &str| {
            let side = node.child(side);
            side.is_some_and(|side| side.child("lane").is_some())
        };
        if section.single_side() == Some(true) && has_lanes("left") && has_lanes("right") {
            let text = format!(
                "this lane section of road `{}` has lanes on both sides, but has `singleSide=\"true\"`; a \
                 single-sided section must have lanes on one side only",
                section.road.id()
            );
            let finding = found.issue(Place::attribute_or_node(node, "singleSide"), text);
            if let Some(s) = section.s() {
                finding.road(section.road.id(), s, 0.0);
            }
        }
    }
}
