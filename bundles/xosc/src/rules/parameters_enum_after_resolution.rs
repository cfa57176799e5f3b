use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_enum_after_resolution",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.enum_after_resolution"],
    after: super::READABLE,
    page: include_str!("parameters_enum_after_resolution.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report_misfits(scenario, ValueFaultKind::Word, found);
    values::report_in_entries(scenario, &[ValueFaultKind::Word], found);
}
