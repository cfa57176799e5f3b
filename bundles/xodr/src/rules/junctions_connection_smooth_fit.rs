use crate::families::gap_levels::{KINK_ERROR_FROM, STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::touching::{GAP, KINK, STEP, Where, report_misfits};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_connection_smooth_fit",
    uids: &["asam.net:xodr:1.9.0:junctions.connection.smooth_fit"],
    // The text about connecting roads contains this requirement since 1.6. Its UID is from 1.9.
    versions: "1.6.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    params: &[
        GAP,
        KINK,
        STEP,
        KINK_ERROR_FROM,
        STEP_ERROR_FROM,
        STEP_BROKEN_FROM,
    ],
    page: include_str!("junctions_connection_smooth_fit.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    report_misfits(map, |at| matches!(at, Where::Connection { .. }), found);
}
