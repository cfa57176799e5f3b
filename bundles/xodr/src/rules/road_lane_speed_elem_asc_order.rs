use crate::families::ascending;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_speed_elem_asc_order",
    uids: &["asam.net:xodr:1.4.0:road.lane.speed.elem_asc_order"],
    versions: "1.1.0..",
    after: super::READABLE,
    params: &[ascending::TOLERANCE],
    page: include_str!("road_lane_speed_elem_asc_order.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    ascending::lane_records(map.part(part), "speed", ascending::VOID, found);
}
