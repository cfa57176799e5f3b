use crate::families::gap_levels::{KINK_ERROR_FROM, STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::touching::{GAP, KINK, STEP, Where, report_misfits};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_direct_linked_lane_smoothness",
    uids: &["asam.net:xodr:1.7.0:junctions.direct.linked_lane_smoothness"],
    versions: "1.7.0..",
    after: super::READABLE,
    params: &[
        GAP,
        KINK,
        STEP,
        KINK_ERROR_FROM,
        STEP_ERROR_FROM,
        STEP_BROKEN_FROM,
    ],
    page: include_str!("junctions_direct_linked_lane_smoothness.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    report_misfits(map, |at| at == Where::Direct, found);
}
