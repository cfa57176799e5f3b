use crate::families::signals;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_resolvable_signal_id_in_traffic_signal_state_action",
    uids: &[
        "asam.net:xosc:1.2.0:reference_control.resolvable_signal_id_in_traffic_signal_state_action",
    ],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("reference_control_resolvable_signal_id_in_traffic_signal_state_action.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    signals::missing_signals(scenario, "TrafficSignalStateAction", "name", found);
}
