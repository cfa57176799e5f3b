use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_story_actions",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_story_actions"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_story_actions.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements("Action") {
        minsubset::only(action, &["PrivateAction"], found);
        for private in action.children_named("PrivateAction") {
            minsubset::only(private, &["RoutingAction"], found);
            for routing in private.children_named("RoutingAction") {
                minsubset::only(routing, &["FollowTrajectoryAction"], found);
            }
        }
    }
}
