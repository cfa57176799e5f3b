use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_variables_dollar_reference",
    uids: &["qcbus.dev:xosc:1.0.0:variables.dollar_reference"],
    versions: "1.2.0..",
    after: super::READABLE,
    page: include_str!("variables_dollar_reference.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report(scenario, &[ValueFaultKind::Variable], found);
}
