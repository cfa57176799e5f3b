use crate::families::ranges;
use crate::families::ranges::tables::CONDITION_DELAY;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["asam.net:xosc:1.0.0:data_type.condition_delay_not_negative"];

const UIDS: [&str; OWN.len() + CONDITION_DELAY.len()] = ranges::uids(&OWN, CONDITION_DELAY);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, CONDITION_DELAY, found);
}
