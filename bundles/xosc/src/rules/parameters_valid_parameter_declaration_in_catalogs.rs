use foldhash::{HashMap, HashMapExt as _};
use qcbus_openscenario::{Form, Scenario, ValueFaultKind};
use qcbus_sdk::{Backport, Rule, Sink};

use crate::families::values;
use crate::model::Scene;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_parameters_valid_parameter_declaration_in_catalogs",
    uids: &["asam.net:xosc:1.2.0:parameters.valid_parameter_declaration_in_catalogs"],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("parameters_valid_parameter_declaration_in_catalogs.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Catalog {
        return;
    }
    values::report(scenario, &[ValueFaultKind::Undeclared], found);
    let mut uses = HashMap::new();
    for (attribute, name) in scenario.parameter_uses() {
        let element = scenario.element(attribute.node());
        if let Some(declaration) = element.parameter(name) {
            uses.entry(declaration.node.index()).or_insert(attribute);
        }
    }
    for fault in values::faults(scenario, &[ValueFaultKind::Declared]) {
        if !values::is_empty_default(scenario, fault) {
            continue;
        }
        let declaration = fault.attribute.node();
        let text = format!(
            "the parameter `{}` has no default: `value` is empty, but must be a value of type `{}`",
            declaration.attr("name").unwrap_or(""),
            declaration.attr("parameterType").unwrap_or("")
        );
        let finding = found.issue(fault.attribute, text);
        if let Some(used) = uses.get(&declaration.index()) {
            finding.at(*used, "where it is used first");
        }
    }
}
