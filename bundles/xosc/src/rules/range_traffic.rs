use crate::families::ranges::tables::TRAFFIC;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_traffic",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_traffic.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + TRAFFIC.len()] = ranges::uids(&[RESOLVED], TRAFFIC);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, TRAFFIC, found);
}
