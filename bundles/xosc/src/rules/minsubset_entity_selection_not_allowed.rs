use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_entity_selection_not_allowed",
    uids: &["asam.net:xosc:1.3.0:minsubset.entity_selection_not_allowed"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_entity_selection_not_allowed.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let instead = "name the scenario objects directly";
    minsubset::none(scenario, &["EntitySelection"], instead, found);
}
