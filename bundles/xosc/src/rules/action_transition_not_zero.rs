use crate::families::actions::{TRANSITIONS, stated};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for dynamics in TRANSITIONS
        .iter()
        .flat_map(|name| scenario.elements_everywhere(name))
    {
        let (Some(shape), Some(dimension)) = (
            dynamics.word("dynamicsShape"),
            dynamics.word("dynamicsDimension"),
        ) else {
            continue;
        };
        if dynamics.number("value") != Some(0.0) || shape == "step" {
            continue;
        }
        let value = stated(dynamics, "value", 0.0);
        let text = match &*dimension {
            "rate" => format!(
                "the rate of a `{shape}` transition is {value}; nothing changes, and the action never ends; the \
                 rate must be greater than 0"
            ),
            "time" | "distance" => format!(
                "the {dimension} of a `{shape}` transition is {value}, which is a jump; use the shape `step`, \
                 because other shapes divide by the {dimension}"
            ),
            _ => continue,
        };
        found.about(dynamics, "value", text);
    }
}
