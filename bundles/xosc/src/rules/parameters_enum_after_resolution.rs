use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report_misfits(scenario, ValueFaultKind::Word, found);
    values::report_in_entries(scenario, &[ValueFaultKind::Word], found);
}
