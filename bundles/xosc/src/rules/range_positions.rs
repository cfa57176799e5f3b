use crate::families::ranges::tables::POSITIONS;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_positions",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_positions.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + POSITIONS.len()] = ranges::uids(&[RESOLVED], POSITIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, POSITIONS, found);
}
