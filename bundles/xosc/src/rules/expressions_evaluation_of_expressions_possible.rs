use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for fault in values::faults(scenario, &[ValueFaultKind::Evaluation]) {
        // The rule about conversions reports a number that is declared as text.
        if values::numeric_text(scenario, fault).is_none() {
            values::say(fault, found);
        }
    }
    values::report_in_entries(scenario, &[ValueFaultKind::Evaluation], found);
    for fault in values::faults(scenario, &[ValueFaultKind::Limit]) {
        // An expression beyond the limits is not evaluated, but it may be correct.
        values::say(fault, found).level(Level::Information);
    }
}
