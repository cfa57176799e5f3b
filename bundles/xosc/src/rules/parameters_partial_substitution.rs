use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[ALLOWED],
    run,
    ..Rule::after(READABLE)
};

const ALLOWED: Param = Param::flag(
    "allowed",
    false,
    "whether the simulator replaces parameters within longer texts, as esmini does",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if found.flag(&ALLOWED) {
        return;
    }
    for fault in values::faults(scenario, &[ValueFaultKind::Embedded]) {
        let element = scenario.element(fault.attribute.node());
        // Otherwise it is a text that contains a `$`.
        if element.parameter(&fault.name).is_some() {
            let level = if is_number(element, fault.attribute) {
                Level::Error
            } else {
                Level::Warning
            };
            values::say(fault, found).level(level);
        }
    }
}

/// Checks whether a number or a boolean is expected. A text with a parameter in it is neither, even
/// if the parameter is replaced.
fn is_number(element: Element<'_, '_>, attribute: Attribute<'_>) -> bool {
    let declared = match element.name() {
        _ if !attribute.is("value") => None,
        "ParameterDeclaration" => element
            .written("parameterType")
            .and_then(DataType::of_declaration),
        "ParameterAssignment" => assigned(element),
        _ => None,
    };
    let value = attribute.value().trim();
    // `-$speed` is a number if the text is replaced.
    let value = value.strip_prefix(['-', '+']).unwrap_or(value);
    declared.is_some_and(|declared| !matches!(declared, DataType::String | DataType::DateTime))
        && value.contains(['*', '/', '+', '-', '(', ' '])
}

/// Returns the type of the entry's parameter that an assignment sets.
fn assigned(assignment: Element<'_, '_>) -> Option<DataType> {
    let reference = assignment.parent()?.parent()?;
    let entry = assignment.scenario().entry(reference)?;
    let name = bare(assignment.written("parameterRef")?);
    entry.declaration(name)?.data_type
}
