use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report(scenario, &[ValueFaultKind::Result], found);
    for fault in values::faults(scenario, &[ValueFaultKind::Narrowed]) {
        values::say(fault, found).level(Level::Warning);
    }
    for fault in values::faults(scenario, &[ValueFaultKind::Evaluation]) {
        let Some(name) = values::numeric_text(scenario, fault) else {
            continue;
        };
        let text = format!(
            "{}: `${name}` is of type `string`, and its text is a number; expressions need numbers, and only \
             some simulators convert it",
            values::written(fault.attribute)
        );
        found.issue(fault.attribute, text).level(Level::Warning);
    }
}
