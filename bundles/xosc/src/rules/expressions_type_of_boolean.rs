use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_expressions_type_of_boolean",
    uids: &["asam.net:xosc:1.1.0:expressions.type_of_boolean"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("expressions_type_of_boolean.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report(scenario, &[ValueFaultKind::Types], found);
}
