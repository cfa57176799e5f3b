use crate::families::ranges;
use crate::families::ranges::tables::ENVIRONMENT;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:environment.ranges"];

const UIDS: [&str; OWN.len() + ENVIRONMENT.len()] = ranges::uids(&OWN, ENVIRONMENT);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, ENVIRONMENT, found);
}
