use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_scenario_objects",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_scenario_objects"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_scenario_objects.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Other rules check the remaining two.
    let passed = ["Vehicle", "ObjectController", "CatalogReference"];
    for object in scenario.elements("ScenarioObject") {
        for kind in object.children() {
            if !passed.contains(&kind.name()) {
                minsubset::outside(kind, "scenario objects must be vehicles", found);
            }
        }
    }
}
