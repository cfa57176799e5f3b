use crate::families::ranges;
use crate::families::ranges::tables::DISTANCES;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_data_type_distances_are_not_negative",
    uids: &UIDS,
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("data_type_distances_are_not_negative.md"),
    run,
    ..Rule::DEFAULTS
};

const OWN: [&str; 1] = ["asam.net:xosc:1.1.0:data_type.distances_are_not_negative"];

const UIDS: [&str; OWN.len() + DISTANCES.len()] = ranges::uids(&OWN, DISTANCES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, DISTANCES, found);
}
