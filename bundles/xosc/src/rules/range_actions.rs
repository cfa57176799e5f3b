use crate::families::ranges::tables::ACTIONS;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_actions",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_actions.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + ACTIONS.len()] = ranges::uids(&[RESOLVED], ACTIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, ACTIONS, found);
}
