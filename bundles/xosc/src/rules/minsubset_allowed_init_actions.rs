use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_init_actions",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_init_actions"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_init_actions.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for actions in scenario.elements("Actions") {
        minsubset::only(actions, &["Private"], found);
    }
    for private in scenario.elements("Private") {
        for action in private.children_named("PrivateAction") {
            minsubset::only(action, &["TeleportAction"], found);
        }
    }
}
