use crate::families::gap_levels::{KINK_ERROR_FROM, STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::touching::{GAP, KINK, STEP, Where, report_misfits};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    // The text about connecting roads contains this requirement since 1.6. Its UID is from 1.9.
    versions: "1.6.0..",
    backport: Backport::Lower { since: "" },
    params: &[
        GAP,
        KINK,
        STEP,
        KINK_ERROR_FROM,
        STEP_ERROR_FROM,
        STEP_BROKEN_FROM,
    ],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    report_misfits(map, |at| matches!(at, Where::Connection { .. }), found);
}
