use crate::families::gap_levels::{GAP_BROKEN_FROM, GAP_ERROR_FROM};
use crate::families::refline::report_gaps;
use crate::prelude::*;

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance between two geometries that is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    // From 1.7 on `lane_smoothness.contact_point_no_horizontal_gaps` requires it as well. Other
    // tools also use its checker.
    versions: "1.4.0..1.7.0",
    backport: Backport::Lower { since: "" },
    params: &[GAP, GAP_ERROR_FROM, GAP_BROKEN_FROM],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    for road in map.part(part).roads() {
        report_gaps(road, limit, found, |_| ());
    }
}
