use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_data_type_allowed_operators",
    uids: &[
        "asam.net:xosc:1.2.0:data_type.allowed_operators",
        "asam.net:xosc:1.1.0:expressions.allowed_operators",
        "qcbus.dev:xosc:1.0.0:expressions.schema_charset",
    ],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "1.1.0" },
    after: super::READABLE,
    page: include_str!("data_type_allowed_operators.md"),
    run,
    ..Rule::DEFAULTS
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
