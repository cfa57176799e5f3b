use qcbus_openscenario::{Scenario, ValueFaultKind};
use qcbus_sdk::{Level, Param, Rule, Sink};

use crate::families::values;
use crate::model::Scene;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_partial_substitution",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.partial_substitution"],
    level: Level::Warning,
    after: super::READABLE,
    params: &[ALLOWED],
    page: include_str!("parameters_partial_substitution.md"),
    run,
    ..Rule::DEFAULTS
};

const ALLOWED: Param = Param::flag(
    "allowed",
    false,
    "whether the simulator replaces parameters within longer texts, as esmini does",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if found.flag(&ALLOWED) {
        return;
    }
    for fault in values::faults(scenario, &[ValueFaultKind::Embedded]) {
        let element = scenario.element(fault.attribute.node());
        // Else it is a text with a `$` in it.
        if element.parameter(&fault.name).is_some() {
            values::say(fault, found);
        }
    }
}
