use qcbus_openscenario::Scenario;
use qcbus_sdk::{Rule, Sink};

use crate::families::ranges;
use crate::families::ranges::tables::GEO;
use crate::model::Scene;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_geo_range",
    uids: &UIDS,
    versions: "1.1..",
    after: super::READABLE,
    page: include_str!("position_geo_range.md"),
    run,
    ..Rule::DEFAULTS
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:position.geo_range"];

const UIDS: [&str; OWN.len() + GEO.len()] = ranges::uids(&OWN, GEO);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, GEO, found);
}
