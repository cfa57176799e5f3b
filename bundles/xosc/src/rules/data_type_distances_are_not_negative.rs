use crate::families::ranges;
use crate::families::ranges::tables::DISTANCES;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["asam.net:xosc:1.1.0:data_type.distances_are_not_negative"];

const UIDS: [&str; OWN.len() + DISTANCES.len()] = ranges::uids(&OWN, DISTANCES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, DISTANCES, found);
}
