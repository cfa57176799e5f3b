use crate::families::actions::{short, slowest, stated};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.1,
    "m/s",
    "largest accepted excess of a target speed over the maximum speed",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for action in scenario.elements_everywhere("SpeedAction") {
        let Some(target) = action.path(&["SpeedActionTarget", "AbsoluteTargetSpeed"]) else {
            continue;
        };
        let Some(speed) = target.number("value") else {
            continue;
        };
        let Some((name, most)) = slowest(action) else {
            continue;
        };
        if speed.abs() <= most + tolerance {
            continue;
        }
        let follows = action
            .child("SpeedActionDynamics")
            .and_then(|dynamics| dynamics.word("followingMode"))
            .is_some_and(|mode| mode == "follow");
        let (level, effect) = if follows {
            (
                Level::Warning,
                "the vehicle must follow within its limits, so it never reaches this speed and the action does \
                 not end",
            )
        } else {
            (
                Level::Information,
                "a simulator either exceeds the limit of the vehicle or stops accelerating at its maximum speed",
            )
        };
        let text = format!(
            "the target speed of {} m/s exceeds the `maxSpeed` of `{name}`, which is {} m/s; {effect}",
            stated(target, "value", speed),
            short(most)
        );
        found.about(target, "value", text).level(level);
    }
}
