use crate::families::ascending::{TOLERANCE, along_road};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_section_elem_asc_order",
    uids: &["asam.net:xodr:1.4.0:road.lane_section.elem_asc_order"],
    versions: "1.1.0..",
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("road_lane_section_elem_asc_order.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for layer in road.layers() {
            along_road(road.id()).check(
                layer.node().children_named("laneSection"),
                |_, _| None,
                found,
            );
        }
    }
}
