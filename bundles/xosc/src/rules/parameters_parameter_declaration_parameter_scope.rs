use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_parameters_parameter_declaration_parameter_scope",
    uids: &["asam.net:xosc:1.1.0:parameters.parameter_declaration_parameter_scope"],
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("parameters_parameter_declaration_parameter_scope.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // The rule about catalogs reports undeclared parameters in a catalog.
    if scenario.form() != Form::Catalog {
        values::report(scenario, &[ValueFaultKind::Undeclared], found);
    }
}
