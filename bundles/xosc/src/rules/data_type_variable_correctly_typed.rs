use crate::families::declared;
use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_data_type_variable_correctly_typed",
    uids: &["asam.net:xosc:1.2.0:data_type.variable_correctly_typed"],
    versions: "1.2.0..",
    after: super::READABLE,
    page: include_str!("data_type_variable_correctly_typed.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for fault in values::faults(
        scenario,
        &[ValueFaultKind::Declared, ValueFaultKind::Parameter],
    ) {
        if fault.attribute.node().is("VariableDeclaration") {
            values::say(fault, found);
        }
    }
    for declaration in declared::VARIABLES.declarations(scenario) {
        if let Some(data_type) = declared::type_of(declaration, "variableType")
            && let Some(Err(text)) = values::typed(declaration, "value", data_type)
        {
            found.about(declaration, "value", text);
        }
    }
    let declared = declared::VARIABLES.by_name(scenario);
    for (element, name) in
        declared::VARIABLES.references(scenario, &["VariableAction", "VariableCondition"])
    {
        let data_type = declared
            .get(&*name)
            .and_then(|declaration| declared::type_of(*declaration, "variableType"));
        let holder = if element.is("VariableAction") {
            element.child("SetAction")
        } else {
            Some(element)
        };
        if let Some((holder, data_type)) = holder.zip(data_type)
            && let Some(Err(text)) = values::typed(holder, "value", data_type)
        {
            found.about(holder, "value", format!("the variable `{name}`: {text}"));
        }
    }
}
