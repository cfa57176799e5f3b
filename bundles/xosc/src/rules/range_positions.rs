use crate::families::ranges::tables::POSITIONS;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + POSITIONS.len()] = ranges::uids(&[RESOLVED], POSITIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, POSITIONS, found);
}
