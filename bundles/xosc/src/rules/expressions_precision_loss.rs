use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (attribute, evaluated) in scenario.expressions() {
        if let Some(lost) = evaluated.imprecise {
            let text = format!(
                "{}: digits are lost; {}",
                values::written(attribute),
                lost.text
            );
            found.issue(attribute, text);
        }
    }
}
