use crate::families::signals::Controllers;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_resolvable_traffic_signal_controller_by_traffic_signal_controller_ref",
    uids: &[
        "asam.net:xosc:1.2.0:reference_control.resolvable_traffic_signal_controller_by_traffic_signal_controller_ref",
    ],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!(
        "reference_control_resolvable_traffic_signal_controller_by_traffic_signal_controller_ref.md"
    ),
    run,
    ..Rule::DEFAULTS
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
