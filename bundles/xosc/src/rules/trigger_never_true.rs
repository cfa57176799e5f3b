use crate::families::actions::stated;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Conditions about quantities that are never below zero, and their names.
const NEVER_NEGATIVE: &[(&str, &str)] = &[
    ("SimulationTimeCondition", "the simulation time"),
    ("TimeHeadwayCondition", "a time headway"),
    ("TimeToCollisionCondition", "a time to collision"),
    ("DistanceCondition", "a distance"),
    ("RelativeDistanceCondition", "a distance"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (name, what) in NEVER_NEGATIVE {
        for condition in scenario.elements_everywhere(name) {
            let (Some(value), Some(rule)) = (condition.number("value"), condition.word("rule"))
            else {
                continue;
            };
            let never = match &*rule {
                "lessThan" => value <= 0.0,
                "lessOrEqual" | "equalTo" => value < 0.0,
                _ => false,
            };
            // For the other quantities, the range rules report numbers below zero.
            if !never || (value < 0.0 && !condition.is("SimulationTimeCondition")) {
                continue;
            }
            let text = format!(
                "the condition requires `{rule}` {}, but {what} is never below 0; it is never true",
                stated(condition, "value", value)
            );
            found.about(condition, "value", text);
        }
    }
}
