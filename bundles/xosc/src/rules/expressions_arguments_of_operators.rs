use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_expressions_arguments_of_operators",
    uids: &["asam.net:xosc:1.1.0:expressions.arguments_of_operators"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("expressions_arguments_of_operators.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report(scenario, &[ValueFaultKind::Arguments], found);
}
