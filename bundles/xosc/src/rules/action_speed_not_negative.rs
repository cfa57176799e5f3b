use crate::families::actions::stated;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for target in scenario.elements_everywhere("AbsoluteTargetSpeed") {
        if let Some(speed) = target.number("value").filter(|speed| *speed < 0.0) {
            let text = format!(
                "the target speed is {} m/s; below 0 an entity drives backwards, which some simulators do not \
                 support",
                stated(target, "value", speed)
            );
            found.about(target, "value", text);
        }
    }
}
