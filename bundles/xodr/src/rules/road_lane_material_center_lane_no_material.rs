use crate::families::center_lane;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_material_center_lane_no_material",
    uids: &["asam.net:xodr:1.4.0:road.lane.material.center_lane_no_material"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_material_center_lane_no_material.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    center_lane::has_no(
        map.part(part),
        "material",
        "it has no area; materials belong to the lanes beside it",
        found,
    );
}
