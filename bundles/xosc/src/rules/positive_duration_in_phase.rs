use crate::families::ranges;
use crate::families::ranges::tables::PHASES;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 2] = [
    "asam.net:xosc:1.2.0:data_type.positive_duration_in_phase",
    "asam.net:xosc:1.0.0:data_type.phase_duration_positive",
];

const UIDS: [&str; OWN.len() + PHASES.len()] = ranges::uids(&OWN, PHASES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, PHASES, found);
}
