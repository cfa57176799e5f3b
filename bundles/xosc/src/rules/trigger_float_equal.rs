use crate::families::actions::stated;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for entity_condition in scenario.elements_everywhere("EntityCondition") {
        for condition in entity_condition.children() {
            if condition.word("rule").as_deref() != Some("equalTo") {
                continue;
            }
            // A standstill and a zero distance between bounding boxes are exactly 0.
            let Some(value) = condition.number("value").filter(|value| *value != 0.0) else {
                continue;
            };
            let text = format!(
                "`{}` requires exactly {}; a measured quantity may pass a value without ever being equal to it, \
                 and then the condition is never true; use `greaterThan` or `lessThan`",
                condition.name(),
                stated(condition, "value", value)
            );
            found.about(condition, "rule", text);
        }
    }
}
