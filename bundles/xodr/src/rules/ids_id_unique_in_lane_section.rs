use std::collections::HashMap;

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:ids.id_unique_in_lane_section",
        "asam.net:xodr:1.9.0:road.lane.lane_id_unique",
    ],
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

/// First version in which another UID states the same requirement.
const BY_LAYER: Version = Version::new(1, 9);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let by_layer = found.version().is_some_and(|version| version >= BY_LAYER);
    for section in map.part(part).sections() {
        let mut seen = HashMap::new();
        for lane in section.lanes() {
            let Some(id) = lane.id() else { continue };
            let Some(first) = seen.get(&id) else {
                seen.insert(id, lane.node());
                continue;
            };
            let text =
                format!("lane id {id} occurs twice in this lane section; each may occur once");
            let finding = found
                .issue(Place::attribute_or_node(lane.node(), "id"), text)
                .at(*first, "the first lane with this id");
            if by_layer {
                finding.uid("asam.net:xodr:1.9.0:road.lane.lane_id_unique");
            }
        }
    }
}
