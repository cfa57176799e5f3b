use crate::families::declared;
use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
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
