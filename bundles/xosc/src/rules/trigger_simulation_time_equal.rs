use crate::families::actions::stated;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let instead = if scenario.version() >= (1, 2) {
        "`greaterOrEqual`"
    } else {
        "`greaterThan`"
    };
    for time in scenario.elements_everywhere("SimulationTimeCondition") {
        if time.word("rule").as_deref() != Some("equalTo") {
            continue;
        }
        // The run begins at 0, so this moment always occurs.
        let Some(value) = time.number("value").filter(|value| *value > 0.0) else {
            continue;
        };
        let text = format!(
            "the simulation time must be equal to {} s, but it advances in steps that may miss that moment, and \
             then the condition is never true; use {instead}, which is true from then on",
            stated(time, "value", value)
        );
        found.about(time, "rule", text);
    }
}
