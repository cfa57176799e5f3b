use crate::families::signals;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_traffic_signal_state_references",
    uids: &["asam.net:xosc:1.0.0:reference_control.traffic_signal_state_references"],
    after: super::READABLE,
    page: include_str!("reference_control_traffic_signal_state_references.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    signals::missing_signals(scenario, "TrafficSignalState", "trafficSignalId", found);
}
