use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_object_controller_not_allowed",
    uids: &["asam.net:xosc:1.3.0:minsubset.object_controller_not_allowed"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_object_controller_not_allowed.md"),
    run,
    ..Rule::DEFAULTS
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
