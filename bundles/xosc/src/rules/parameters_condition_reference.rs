use qcbus_openscenario::{Form, Scenario};
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::declared;
use crate::families::references;
use crate::model::{About, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_condition_reference",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.condition_reference"],
    after: super::READABLE,
    page: include_str!("parameters_condition_reference.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario {
        return;
    }
    let declared = declared::PARAMETERS.by_name(scenario);
    let references =
        declared::PARAMETERS.references(scenario, &["ParameterAction", "ParameterCondition"]);
    for (element, name) in references {
        if declared.contains_key(&*name) {
            continue;
        }
        if let Some(inner) = element.parameter(&name) {
            let text = format!(
                "`{}` refers to the parameter `{name}`, which is not declared at the top of the scenario but \
                 further in; only parameters at the top are sure to be found",
                element.name()
            );
            found
                .about(element, "parameterRef", text)
                .level(Level::Warning)
                .at(inner.node, "its declaration");
        } else {
            let names = declared.keys().copied();
            references::unresolved(element, "parameterRef", &name, "parameter", names, found);
        }
    }
}
