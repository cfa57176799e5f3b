use crate::families::declared;
use crate::families::values;
use crate::prelude::*;
use qcbus_openscenario::ValueFault;

pub const RULE: Rule<Scene> = Rule {
    readers: Some(Readers::by_case(
        "a value of another type does no harm where the parameter is only used as text of properties",
    )),
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for fault in values::faults(scenario, &[ValueFaultKind::Declared]) {
        if values::is_of_other_rule(scenario, fault) {
            continue;
        }
        let finding = values::say(fault, found).level(level(fault));
        if is_text_only(fault.attribute.node()) {
            finding.readers_level(Level::Warning);
        }
    }
    let kinds = [ValueFaultKind::Declared, ValueFaultKind::Parameter];
    for (element, fault) in scenario.entry_faults_of(&kinds) {
        let level = match fault.kind {
            ValueFaultKind::Parameter => Level::Error,
            _ if values::is_about_time(fault) => continue,
            // It is an error in the result of the catalog itself. Here the default may be used as
            // text only.
            _ => Level::Warning,
        };
        let text = format!("{}: {}", values::written(fault.attribute), fault.text);
        let name = fault.attribute.name();
        found.about(element, name, text).level(level);
    }
    values::report_misfits(scenario, ValueFaultKind::Parameter, found);
    for declaration in scenario.elements("ParameterDeclaration") {
        if declared::type_of(declaration, "parameterType") == Some(DataType::Double)
            && declaration.double("value").is_some_and(f64::is_nan)
        {
            let text = "the value is `NaN`, which is not equal to, less than or greater than any number, so it \
                        cannot be used in computations or comparisons";
            found
                .about(declaration, "value", text)
                .level(Level::Warning);
        }
    }
    run_time(scenario, found);
}

/// Returns the level. It is a warning for `5.0`, because most simulators read it as 5.
fn level(fault: &ValueFault<'_>) -> Level {
    let attribute = fault.attribute;
    let declared = attribute.node().attr("parameterType");
    let data_type = declared.and_then(DataType::of_declaration);
    let whole = data_type.and_then(|data_type| values::whole(attribute.value(), data_type));
    if attribute.is("value") && whole.is_some() {
        Level::Warning
    } else {
        Level::Error
    }
}

/// Checks whether a declared parameter is used only in values of properties, which are text.
fn is_text_only(declaration: Node<'_>) -> bool {
    let scope = declaration.parent().and_then(|it| it.parent());
    let (Some(scope), Some(name)) = (scope, declaration.attr("name")) else {
        return false;
    };
    let uses = |value: &str| {
        let mut found = value.match_indices(name);
        value.contains('$')
            && found.any(|(at, _)| {
                let rest = &value[at + name.len()..];
                !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')
            })
    };
    let attributes = scope
        .descendants()
        .flat_map(|node| node.attributes().map(move |attribute| (node, attribute)));
    let mut places = attributes.filter(|(_, attribute)| match attribute.name() {
        "parameterRef" => attribute.value() == name,
        _ => uses(attribute.value()),
    });
    let is_property =
        |(node, attribute): (Node<'_>, Attribute<'_>)| node.is("Property") && attribute.is("value");
    // An unused parameter may be meant for a set of values.
    places.next().is_some_and(is_property) && places.all(is_property)
}

/// Checks values that a parameter is set to or compared with at run time.
fn run_time(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let declared = declared::PARAMETERS.by_name(scenario);
    let references =
        declared::PARAMETERS.references(scenario, &["ParameterAction", "ParameterCondition"]);
    for (element, name) in references {
        let data_type = declared
            .get(&*name)
            .and_then(|declaration| declared::type_of(*declaration, "parameterType"));
        let holder = if element.is("ParameterAction") {
            element.child("SetAction")
        } else {
            Some(element)
        };
        let Some((holder, data_type)) = holder.zip(data_type) else {
            continue;
        };
        if let Some(Err(text)) = values::typed(holder, "value", data_type) {
            found.about(holder, "value", format!("the parameter `{name}`: {text}"));
        }
    }
}
