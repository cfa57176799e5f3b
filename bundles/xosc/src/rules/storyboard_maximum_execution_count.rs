use crate::families::ranges;
use crate::families::ranges::tables::EXECUTIONS;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:storyboard.maximum_execution_count"];

const UIDS: [&str; OWN.len() + EXECUTIONS.len()] = ranges::uids(&OWN, EXECUTIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, EXECUTIONS, found);
}
