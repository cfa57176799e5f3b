use crate::families::triggers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// Checks whether the act has any content. Scenarios that only place entities have an empty act
/// because older schemas require one.
fn has_content(act: Element<'_, '_>) -> bool {
    triggers::maneuvers(act).next().is_some()
}

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let remedy = if scenario.version() >= (1, 3) {
        "an act without `StartTrigger` starts at once"
    } else {
        "to start an act at once, use a condition such as a simulation time greater than 0"
    };
    triggers::empty_starts(scenario, "Act", has_content, remedy, found);
}
