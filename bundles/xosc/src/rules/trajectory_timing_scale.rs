use crate::families::ranges;
use crate::families::ranges::tables::TIMING;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:trajectory.timing_scale"];

const UIDS: [&str; OWN.len() + TIMING.len()] = ranges::uids(&OWN, TIMING);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, TIMING, found);
}
