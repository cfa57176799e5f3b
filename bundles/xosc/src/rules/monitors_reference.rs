use crate::families::declared;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_monitors_reference",
    uids: &["qcbus.dev:xosc:1.0.0:monitors.reference"],
    versions: "1.3.0..",
    after: super::READABLE,
    page: include_str!("monitors_reference.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Any scenario may use a catalog's maneuver.
    if scenario.form() == Form::Scenario {
        declared::MONITORS.resolve(scenario, found);
    }
}
