use crate::families::gap_levels::{STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::profile_steps::{elevation, lateral};
use crate::families::touching::STEP;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_lane_smoothness_profile_no_vertical_gaps",
    uids: &["qcbus.dev:xodr:1.8.0:lane_smoothness.profile_no_vertical_gaps"],
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    params: &[STEP, STEP_ERROR_FROM, STEP_BROKEN_FROM],
    page: include_str!("lane_smoothness_profile_no_vertical_gaps.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        elevation(road, found);
        lateral(road, found);
    }
}
