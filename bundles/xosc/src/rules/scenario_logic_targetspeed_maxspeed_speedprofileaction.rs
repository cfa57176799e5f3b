use crate::families::actions::{short, slowest, stated};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.2.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.1,
    "m/s",
    "largest accepted excess of a speed over the maximum speed",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for action in scenario.elements_everywhere("SpeedProfileAction") {
        // With a reference entity the speeds are relative to its speed.
        let follows = action
            .word("followingMode")
            .is_some_and(|mode| mode == "follow");
        if !follows || action.has("entityRef") {
            continue;
        }
        let Some((name, most)) = slowest(action) else {
            continue;
        };
        let beyond: Vec<(Element<'_, '_>, f64)> = action
            .children_named("SpeedProfileEntry")
            .filter_map(|entry| Some((entry, entry.number("speed")?)))
            .filter(|(_, speed)| speed.abs() > most + tolerance)
            .collect();
        let Some((entry, speed)) = beyond.first().copied() else {
            continue;
        };
        let further = match beyond.len() - 1 {
            0 => String::new(),
            further => format!(" (one of {} such entries)", further + 1),
        };
        let text = format!(
            "the speed of {} m/s{further} exceeds the `maxSpeed` of `{name}`, which is {} m/s; in mode `follow` \
             it is never reached",
            stated(entry, "speed", speed),
            short(most)
        );
        found.about(entry, "speed", text);
    }
}
