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
