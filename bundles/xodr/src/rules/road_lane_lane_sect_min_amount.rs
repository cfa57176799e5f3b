use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.lane.lane_sect_min_amount",
        "asam.net:xodr:1.4.0:road.lane_section.lane_sect_req",
    ],
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

const PER_ROAD: &str = "asam.net:xodr:1.4.0:road.lane_section.lane_sect_req";

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        if road.layers().is_empty() {
            let text = format!(
                "road `{}` has no `lanes`; each road must have at least one lane section",
                road.id()
            );
            found
                .issue(road.node(), text)
                .uid(PER_ROAD)
                .fault(fault_of(road.node()));
        }
        for layer in road
            .layers()
            .iter()
            .filter(|layer| layer.section_count() == 0)
        {
            let text = format!(
                "these `lanes` of road `{}` contain no `laneSection`; there must be at least one",
                road.id()
            );
            found
                .issue(layer.node(), text)
                .fault(fault_of(layer.node()));
        }
    }
}
