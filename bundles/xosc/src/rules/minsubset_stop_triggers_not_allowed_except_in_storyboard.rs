use crate::families::minsubset;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for act in scenario.elements("Act") {
        for trigger in act.children_named("StopTrigger") {
            minsubset::outside(trigger, "only the storyboard may have one", found);
        }
    }
}
