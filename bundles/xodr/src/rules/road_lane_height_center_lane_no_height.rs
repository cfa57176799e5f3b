use crate::families::center_lane;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_height_center_lane_no_height",
    uids: &["asam.net:xodr:1.4.0:road.lane.height.center_lane_no_height"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_height_center_lane_no_height.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    center_lane::has_no(
        map.part(part),
        "height",
        "it lies on the road surface and must not be raised",
        found,
    );
}
