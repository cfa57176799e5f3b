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
    for object in scenario.elements("ScenarioObject") {
        for controller in object.children_named("ObjectController") {
            minsubset::outside(
                controller,
                "entities follow their trajectories without a controller",
                found,
            );
        }
    }
}
