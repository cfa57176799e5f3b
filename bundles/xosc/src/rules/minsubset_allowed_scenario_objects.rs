use crate::families::minsubset;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
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
