use crate::families::ranges::tables::TRAJECTORIES;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_trajectories",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_trajectories.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + TRAJECTORIES.len()] = ranges::uids(&[RESOLVED], TRAJECTORIES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, TRAJECTORIES, found);
}
