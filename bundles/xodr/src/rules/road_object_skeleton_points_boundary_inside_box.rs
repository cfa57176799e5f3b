use crate::families::object_frame::{TOLERANCE, report_outside};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_skeleton_points_boundary_inside_box",
    uids: &["asam.net:xodr:1.9.0:road.object.skeleton.points_boundary_inside_box"],
    versions: "1.9.0..",
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("road_object_skeleton_points_boundary_inside_box.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    report_outside(
        map.part(part),
        |frame, object| {
            object
                .polylines()
                .flat_map(|line| frame.vertices(&line, true))
                .collect()
        },
        "the skeleton (even without the width of its ends)",
        found,
    );
}
