use crate::families::ranges::tables::CONDITIONS;
use crate::families::ranges::{self, RESOLVED};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const UIDS: [&str; 1 + CONDITIONS.len()] = ranges::uids(&[RESOLVED], CONDITIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report(scenario, CONDITIONS, found);
}
