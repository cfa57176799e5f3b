use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.1.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
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
