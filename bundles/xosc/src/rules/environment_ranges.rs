use crate::families::ranges;
use crate::families::ranges::tables::ENVIRONMENT;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_environment_ranges",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("environment_ranges.md"),
    run,
    ..Rule::DEFAULTS
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:environment.ranges"];

const UIDS: [&str; OWN.len() + ENVIRONMENT.len()] = ranges::uids(&OWN, ENVIRONMENT);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, ENVIRONMENT, found);
}
