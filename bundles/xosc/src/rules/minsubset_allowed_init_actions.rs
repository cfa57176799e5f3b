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
    for actions in scenario.elements("Actions") {
        minsubset::only(actions, &["Private"], found);
    }
    for private in scenario.elements("Private") {
        for action in private.children_named("PrivateAction") {
            minsubset::only(action, &["TeleportAction"], found);
        }
    }
}
