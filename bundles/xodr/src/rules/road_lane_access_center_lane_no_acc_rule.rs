use crate::families::center_lane;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_access_center_lane_no_acc_rule",
    uids: &["asam.net:xodr:1.4.0:road.lane.access.center_lane_no_acc_rule"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_access_center_lane_no_acc_rule.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    center_lane::has_no(
        map.part(part),
        "access",
        "it carries no traffic; access rules belong to the lanes beside it",
        found,
    );
}
