use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &[
        "asam.net:xosc:1.2.0:data_type.allowed_operators",
        "asam.net:xosc:1.1.0:expressions.allowed_operators",
        "qcbus.dev:xosc:1.0.0:expressions.schema_charset",
    ],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    values::report(scenario, &[ValueFaultKind::Operator], found);
    for (attribute, evaluated) in scenario.expressions() {
        for newer in evaluated.newer {
            let ((major, minor), (of_major, of_minor)) = (newer.since, scenario.version());
            let text = format!(
                "{}: `{}` is part of the expression language from version {major}.{minor} on, but the file has \
                 version {of_major}.{of_minor}; only some simulators support it there",
                values::written(attribute),
                newer.name
            );
            found.issue(attribute, text).level(Level::Warning);
        }
    }
}
