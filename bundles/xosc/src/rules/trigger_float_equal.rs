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
            exact_position(condition, found);
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

/// Reports a position that must be reached exactly.
fn exact_position(condition: Element<'_, '_>, found: &mut Sink<'_>) {
    if condition.is("ReachPositionCondition") && condition.number("tolerance") == Some(0.0) {
        let text = "`ReachPositionCondition` has a `tolerance` of 0; an entity may pass a position without \
                    ever being exactly there, and then the condition is never true; use a tolerance of some \
                    metres";
        found.about(condition, "tolerance", text);
    }
}
