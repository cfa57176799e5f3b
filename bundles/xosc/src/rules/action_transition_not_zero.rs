use crate::families::actions::{TRANSITIONS, stated};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_action_transition_not_zero",
    uids: &["qcbus.dev:xosc:1.0.0:action.transition_not_zero"],
    level: Level::Warning,
    versions: "1.0.0..",
    after: super::READABLE,
    page: include_str!("action_transition_not_zero.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for dynamics in TRANSITIONS
        .iter()
        .flat_map(|name| scenario.elements_everywhere(name))
    {
        let (Some(shape), Some(dimension)) = (
            dynamics.word("dynamicsShape"),
            dynamics.word("dynamicsDimension"),
        ) else {
            continue;
        };
        if dynamics.number("value") != Some(0.0) || shape == "step" {
            continue;
        }
        let value = stated(dynamics, "value", 0.0);
        let text = match &*dimension {
            "rate" => format!(
                "the rate of a `{shape}` transition is {value}; nothing changes, and the action never ends; the \
                 rate must be greater than 0"
            ),
            "time" | "distance" => format!(
                "the {dimension} of a `{shape}` transition is {value}, which is a jump; use the shape `step`, \
                 because other shapes divide by the {dimension}"
            ),
            _ => continue,
        };
        found.about(dynamics, "value", text);
    }
}
