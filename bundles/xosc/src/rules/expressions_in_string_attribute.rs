use crate::families::values;
use crate::prelude::*;
use qcbus_openscenario::expr;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for fault in values::faults(scenario, &[ValueFaultKind::InText]) {
        let attribute = fault.attribute;
        if is_reference(attribute.name()) {
            continue;
        }
        let declared = attribute.node().attr("parameterType");
        let level = if declared == Some("dateTime") {
            Level::Error
        } else if reads_as_expression(attribute.value(), scenario.version()) {
            Level::Warning
        } else {
            Level::Information
        };
        values::say(fault, found).level(level);
    }
}

/// Checks whether the attribute refers to a name. The rules about references report unresolved
/// names.
fn is_reference(attribute: &str) -> bool {
    attribute.ends_with("Ref") || matches!(attribute, "catalogName" | "entryName")
}

/// Checks whether the text is probably meant as an expression. Text that cannot be parsed is a text
/// in braces.
fn reads_as_expression(text: &str, version: (u16, u16)) -> bool {
    use expr::{FaultKind, Operand};
    match expr::evaluate(text, version, &|_| Operand::Unresolved) {
        Ok(_) => true,
        Err(fault) => matches!(fault.kind, FaultKind::Unresolved | FaultKind::Types),
    }
}
