use crate::families::triggers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let remedy = if scenario.version() >= (1, 1) {
        "an event without `StartTrigger` starts with its act"
    } else {
        "to start an event with its act, use a condition such as a simulation time greater than 0"
    };
    triggers::empty_starts(scenario, "Event", |_| true, remedy, found);
}
