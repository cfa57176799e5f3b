use crate::families::ranges;
use crate::families::ranges::tables::TRANSITIONS;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    // Lights exist since this version, so older files have none.
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] =
    ["asam.net:xosc:1.2.0:data_type.non_negative_transition_time_in_light_state_action"];

const UIDS: [&str; OWN.len() + TRANSITIONS.len()] = ranges::uids(&OWN, TRANSITIONS);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, TRANSITIONS, found);
}
