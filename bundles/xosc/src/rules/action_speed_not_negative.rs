use crate::families::actions::stated;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_action_speed_not_negative",
    uids: &["qcbus.dev:xosc:1.0.0:action.speed_not_negative"],
    level: Level::Information,
    versions: "1.0.0..",
    after: super::READABLE,
    page: include_str!("action_speed_not_negative.md"),
    run,
    ..Rule::DEFAULTS
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
