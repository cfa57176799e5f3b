use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_position_types",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_position_types"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_position_types.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for position in scenario.elements("Position") {
        minsubset::only(position, &["WorldPosition"], found);
    }
}
