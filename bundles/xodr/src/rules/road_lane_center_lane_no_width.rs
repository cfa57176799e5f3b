use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Rule, Sink};

use crate::families::center_lane;
use crate::model::Roads;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_center_lane_no_width",
    uids: &["asam.net:xodr:1.4.0:road.lane.center_lane_no_width"],
    versions: "1.4.0..",
    after: super::READABLE,
    page: include_str!("road_lane_center_lane_no_width.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for element in ["width", "border"] {
        center_lane::has_no(map, element, "it is a line without any extent", found);
    }
}
