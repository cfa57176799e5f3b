use crate::families::object_frame::{ObjectFrame, TOLERANCE, report_too_large};
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
    for (road, object) in map.part(part).objects() {
        let Some(frame) = ObjectFrame::of(road, &object) else {
            continue;
        };
        let points: Vec<_> = object
            .polylines()
            .flat_map(|line| frame.vertices(&line, true))
            .collect();
        report_too_large(
            road,
            &object,
            &points,
            "the skeleton (even without the width of its ends)",
            found,
        );
    }
}
