use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_forward_or_cyclic",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.forward_or_cyclic"],
    after: super::READABLE,
    page: include_str!("parameters_forward_or_cyclic.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report(scenario, &[ValueFaultKind::Order], found);
}
