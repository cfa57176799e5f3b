use crate::families::signals;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_road_signal_condition",
    uids: &["qcbus.dev:xosc:1.0.0:road.signal_condition"],
    after: super::READABLE,
    page: include_str!("road_signal_condition.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    signals::missing_signals(scenario, "TrafficSignalCondition", "name", found);
}
