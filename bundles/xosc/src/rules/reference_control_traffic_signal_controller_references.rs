use crate::families::signals::Controllers;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_traffic_signal_controller_references",
    uids: &["asam.net:xosc:1.0.0:reference_control.traffic_signal_controller_references"],
    after: super::READABLE,
    page: include_str!("reference_control_traffic_signal_controller_references.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let controllers = Controllers::of(scenario);
    for controller in &controllers.all {
        controllers.resolve(*controller, "reference", found);
    }
}
