use crate::families::ranges::tables::TRAFFIC;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + TRAFFIC.len()] = ranges::uids(&[RESOLVED], TRAFFIC);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, TRAFFIC, found);
}
