use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // The rule about catalogs reports undeclared parameters in a catalog.
    if scenario.form() != Form::Catalog {
        values::report(scenario, &[ValueFaultKind::Undeclared], found);
    }
}
