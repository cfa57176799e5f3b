use crate::families::gap_levels::{KINK_ERROR_FROM, STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::touching::{GAP, KINK, STEP, Where, report_misfits};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
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
    report_misfits(map, |at| at == Where::Direct, found);
}
