use crate::families::ascending::{TOLERANCE, VOID, along_road, children};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_superelevation_elem_asc_order",
    uids: &["asam.net:xodr:1.4.0:road.superelevation.elem_asc_order"],
    versions: "1.1.0..",
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("road_superelevation_elem_asc_order.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        along_road(road.id()).check(children(road.lateral_node(), "superelevation"), VOID, found);
    }
}
