use crate::families::ranges::tables::ENTITIES;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + ENTITIES.len()] = ranges::uids(&[RESOLVED], ENTITIES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, ENTITIES, found);
}
