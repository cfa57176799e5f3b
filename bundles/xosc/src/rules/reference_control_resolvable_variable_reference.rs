use crate::families::declared;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_resolvable_variable_reference",
    uids: &["asam.net:xosc:1.2.0:reference_control.resolvable_variable_reference"],
    versions: "1.2.0..",
    after: super::READABLE,
    page: include_str!("reference_control_resolvable_variable_reference.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Any scenario may use a catalog's maneuver.
    if scenario.form() == Form::Scenario {
        declared::VARIABLES.resolve(scenario, found);
    }
}
