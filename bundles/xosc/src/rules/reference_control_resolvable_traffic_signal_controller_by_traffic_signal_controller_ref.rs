use crate::families::signals::Controllers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // A maneuver in a catalog may be meant for scenarios with the controller.
    if scenario.form() != Form::Scenario {
        return;
    }
    let controllers = Controllers::of(scenario);
    for element in [
        "TrafficSignalControllerAction",
        "TrafficSignalControllerCondition",
    ] {
        for reference in scenario.elements_everywhere(element) {
            controllers.resolve(reference, "trafficSignalControllerRef", found);
        }
    }
}
