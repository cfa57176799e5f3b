use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(storyboard) = scenario.root().child("Storyboard") else {
        return;
    };
    match storyboard.child("StopTrigger") {
        Some(trigger) if trigger.children().next().is_none() => {
            let text = "the `StopTrigger` of the storyboard is empty and never true, so nothing ends the run; \
                        use a `SimulationTimeCondition`";
            found.about(trigger, "", text);
        }
        // Before 1.3 the schema requires one.
        None if scenario.version() >= (1, 3) => {
            let text = "the storyboard has no `StopTrigger`, so nothing ends the run; use a \
                        `SimulationTimeCondition`";
            found.about(storyboard, "", text);
        }
        _ => {}
    }
}
