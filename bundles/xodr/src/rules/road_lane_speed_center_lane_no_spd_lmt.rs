use crate::families::center_lane;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_speed_center_lane_no_spd_lmt",
    uids: &["asam.net:xodr:1.4.0:road.lane.speed.center_lane_no_spd_lmt"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_speed_center_lane_no_spd_lmt.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    center_lane::has_no(
        map.part(part),
        "speed",
        "it carries no traffic; speed limits belong to the lanes beside it",
        found,
    );
}
