use crate::families::gap_levels::{GAP_BROKEN_FROM, GAP_ERROR_FROM};
use crate::families::refline::report_gaps;
use crate::prelude::*;

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance between two geometries that is accepted",
);

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_geometry_refline_no_gaps",
    uids: &["asam.net:xodr:1.4.0:road.geometry.refline_no_gaps"],
    // From 1.7 on `lane_smoothness.contact_point_no_horizontal_gaps` requires it as well. Other
    // tools also use its checker.
    versions: "1.4.0..1.7.0",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    params: &[GAP, GAP_ERROR_FROM, GAP_BROKEN_FROM],
    page: include_str!("road_geometry_refline_no_gaps.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    for road in map.part(part).roads() {
        report_gaps(road, limit, found, |_| ());
    }
}
