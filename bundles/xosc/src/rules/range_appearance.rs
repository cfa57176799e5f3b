use crate::families::ranges::tables::APPEARANCE;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_appearance",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_appearance.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + APPEARANCE.len()] = ranges::uids(&[RESOLVED], APPEARANCE);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, APPEARANCE, found);
}
