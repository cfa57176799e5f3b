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
        let Some(value) = dynamics.number("value").filter(|value| *value != 0.0) else {
            continue;
        };
        if shape == "step" && matches!(&*dimension, "time" | "distance") {
            let text = format!(
                "a step happens at once, so its {dimension} must be 0, but is {}; simulators ignore the value; \
                 for a transition of this length use `linear`, `cubic` or `sinusoidal`",
                stated(dynamics, "value", value)
            );
            found
                .about(dynamics, "value", text)
                .fault("steps with a value");
        }
    }
}
