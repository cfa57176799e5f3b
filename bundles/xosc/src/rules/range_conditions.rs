use crate::families::ranges::tables::CONDITIONS;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_conditions",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_conditions.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + CONDITIONS.len()] = ranges::uids(&[RESOLVED], CONDITIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, CONDITIONS, found);
}
