use crate::families::ranges::tables::ENTITIES;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_range_entities",
    uids: &UIDS,
    after: super::READABLE,
    page: include_str!("range_entities.md"),
    run,
    ..Rule::DEFAULTS
};

const UIDS: [&str; 1 + ENTITIES.len()] = ranges::uids(&[RESOLVED], ENTITIES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, ENTITIES, found);
}
