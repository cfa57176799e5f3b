use crate::families::lane_numbers::{number, outward, word};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_lane_order",
    uids: &["asam.net:xodr:1.4.0:road.lane.lane_order"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_lane_order.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            let lanes = outward(section, side);
            let Some((distance, lane)) = lanes.first().filter(|(distance, _)| *distance != 1)
            else {
                continue;
            };
            let text = format!(
                "the innermost lane on the {} has id {}; numbering must start with {} next to the \
                 center lane",
                word(side),
                number(side, *distance),
                number(side, 1)
            );
            found.issue(Place::attribute_or_node(lane.node(), "id"), text);
        }
    }
}
