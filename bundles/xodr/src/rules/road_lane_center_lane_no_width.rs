use crate::families::center_lane;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_center_lane_no_width",
    uids: &["asam.net:xodr:1.4.0:road.lane.center_lane_no_width"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_center_lane_no_width.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for element in ["width", "border"] {
        center_lane::has_no(
            map.part(part),
            element,
            "it is a line and has no extent",
            found,
        );
    }
}
