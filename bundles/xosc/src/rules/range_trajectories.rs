use crate::families::ranges::tables::TRAJECTORIES;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + TRAJECTORIES.len()] = ranges::uids(&[RESOLVED], TRAJECTORIES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, TRAJECTORIES, found);
}
