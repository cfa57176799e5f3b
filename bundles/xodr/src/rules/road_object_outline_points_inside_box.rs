use crate::families::object_frame::{ObjectFrame, TOLERANCE, report_too_large};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_outline_points_inside_box",
    uids: &["asam.net:xodr:1.7.0:road.object.outline.points_inside_box"],
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("road_object_outline_points_inside_box.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for (road, object) in map.part(part).objects() {
        let Some(frame) = ObjectFrame::of(road, &object) else {
            continue;
        };
        let points: Vec<_> = object
            .outlines()
            .flat_map(|outline| frame.corners(&outline))
            .collect();
        report_too_large(road, &object, &points, "the outline", found);
    }
}
