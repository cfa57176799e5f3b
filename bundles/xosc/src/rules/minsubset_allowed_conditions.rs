use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_conditions",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_conditions"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_conditions.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for condition in scenario.elements("Condition") {
        minsubset::only(condition, &["ByValueCondition"], found);
    }
    let allowed = ["SimulationTimeCondition", "StoryboardElementStateCondition"];
    for condition in scenario.elements("ByValueCondition") {
        minsubset::only(condition, &allowed, found);
    }
}
