use qcbus_opendrive::{RoadMap, Side};
use qcbus_sdk::{Place, Rule, Sink};

use crate::families::lane_numbers::word;
use crate::model::Roads;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_lanes_numbered_correctly",
    uids: &["asam.net:xodr:1.4.0:road.lane.lanes_numbered_correctly"],
    versions: "1.4.0..",
    after: super::READABLE,
    page: include_str!("road_lane_lanes_numbered_correctly.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for lane in map.lanes() {
        let (Some(side), Some(id)) = (lane.side(), lane.id()) else {
            continue;
        };
        // 0 is the business of the rule about the center lane's id.
        if id == 0 || Side::of_lane_id(id) == Some(side) {
            continue;
        }
        let kind = match side {
            Side::Left => "positive",
            Side::Right => "negative",
        };
        let text = format!(
            "lane {id} is listed to the {} of the center lane; ids there must be {kind}",
            word(side)
        );
        found.issue(Place::attribute_or_node(lane.node(), "id"), text);
    }
}
