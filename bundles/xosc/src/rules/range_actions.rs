use crate::families::ranges::tables::ACTIONS;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + ACTIONS.len()] = ranges::uids(&[RESOLVED], ACTIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, ACTIONS, found);
}
