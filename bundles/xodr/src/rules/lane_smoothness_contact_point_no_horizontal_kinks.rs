use crate::families::gap_levels::KINK_ERROR_FROM;
use crate::families::touching::{GAP, KINK, Where, pairs, report_kink};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_lane_smoothness_contact_point_no_horizontal_kinks",
    uids: &["qcbus.dev:xodr:1.8.0:lane_smoothness.contact_point_no_horizontal_kinks"],
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    params: &[GAP, KINK, KINK_ERROR_FROM],
    page: include_str!("lane_smoothness_contact_point_no_horizontal_kinks.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    // Separate rules cover junctions: `junctions.connection.smooth_fit` and similar ones.
    for pair in pairs(map.part(part)).filter(|pair| pair.at == Where::Roads && !pair.is_kerb()) {
        report_kink(&pair, found);
    }
}
