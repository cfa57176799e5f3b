use crate::families::actions::stated;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    // Some simulators drop one of the two and continue.
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("SpeedAction") {
        let target = action.path(&["SpeedActionTarget", "RelativeTargetSpeed"]);
        let (Some(target), Some(dynamics)) = (target, action.child("SpeedActionDynamics")) else {
            continue;
        };
        let (Some(dimension), Some(shape)) = (
            dynamics.word("dynamicsDimension"),
            dynamics.word("dynamicsShape"),
        ) else {
            continue;
        };
        let timed = matches!(&*dimension, "time" | "distance") && shape != "step";
        // A value of 0 and a step need neither time nor distance.
        let value = dynamics.number("value").filter(|value| *value > 0.0);
        let (Some(value), true, Some(true)) = (value, timed, target.flag("continuous")) else {
            continue;
        };
        let text = format!(
            "the relative speed is kept continuously, which is not allowed together with a {dimension} to reach \
             it (here {}), because such an action never ends; use a `rate` or `continuous=\"false\"`",
            stated(dynamics, "value", value)
        );
        found
            .about(target, "continuous", text)
            .at(dynamics.node(), "its dynamics");
    }
}
