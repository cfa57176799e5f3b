use crate::families::ranges::tables::APPEARANCE;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + APPEARANCE.len()] = ranges::uids(&[RESOLVED], APPEARANCE);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, APPEARANCE, found);
}
