use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_expressions_unused_constant",
    uids: &["qcbus.dev:xosc:1.0.0:expressions.unused_constant"],
    level: Level::Information,
    versions: "1.1.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("expressions_unused_constant.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (attribute, evaluated) in scenario.expressions() {
        if !evaluated.uses_parameters {
            let value: Value<'_> = evaluated.value.into();
            let text = format!(
                "{}: no parameter is used, so the value is always `{}` and can be written directly",
                values::written(attribute),
                value.text()
            );
            found.issue(attribute, text);
        }
    }
}
