use crate::families::gap_levels::{STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::profile_steps::{elevation, lateral};
use crate::families::touching::STEP;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    params: &[STEP, STEP_ERROR_FROM, STEP_BROKEN_FROM],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        elevation(road, found);
        lateral(road, found);
    }
}
