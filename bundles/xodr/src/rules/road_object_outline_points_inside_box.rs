use crate::families::object_frame::{TOLERANCE, report_outside};
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
    report_outside(
        map.part(part),
        |frame, object| {
            object
                .outlines()
                .flat_map(|outline| frame.corners(&outline))
                .collect()
        },
        "the outline",
        found,
    );
}
