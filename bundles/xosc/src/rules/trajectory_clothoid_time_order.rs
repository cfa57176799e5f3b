use crate::families::positions::shown;
use crate::families::trajectories::{Timing, timing_of};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for clothoid in scenario.elements_everywhere("Clothoid") {
        let times = clothoid
            .number("startTime")
            .zip(clothoid.number("stopTime"));
        // A stop time of zero or below is already out of range.
        let wrong = times.filter(|(start, stop)| start >= stop && *stop > 0.0);
        let Some((start, stop)) = wrong else {
            continue;
        };
        let timing = clothoid.ancestor("Trajectory").map(timing_of);
        let level = match timing {
            Some(Timing::Asked(_)) => Level::Error,
            // Exporters write two zeros if there are no times.
            _ if start <= stop => continue,
            _ => Level::Warning,
        };
        let text = format!(
            "`stopTime` of `Clothoid` is {} s, but `startTime` is {start} s; it must stop after it starts",
            shown(clothoid, "stopTime", &stop.to_string()),
        );
        found.about(clothoid, "stopTime", text).level(level);
    }
}
