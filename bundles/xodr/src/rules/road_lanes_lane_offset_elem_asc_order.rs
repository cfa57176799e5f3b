use crate::families::ascending::{TOLERANCE, VOID, along_road};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lanes_lane_offset_elem_asc_order",
    uids: &["asam.net:xodr:1.4.0:road.lanes.lane_offset.elem_asc_order"],
    versions: "1.1.0..",
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("road_lanes_lane_offset_elem_asc_order.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for layer in road.layers() {
            along_road(road.id()).check(layer.node().children_named("laneOffset"), VOID, found);
        }
    }
}
