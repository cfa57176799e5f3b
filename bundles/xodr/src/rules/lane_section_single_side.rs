use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
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
