use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_action_distance_exclusive",
    uids: &["qcbus.dev:xosc:1.0.0:action.distance_exclusive"],
    versions: "1.0.0..",
    after: super::READABLE,
    page: include_str!("action_distance_exclusive.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("LongitudinalDistanceAction") {
        match (action.has("distance"), action.has("timeGap")) {
            (true, true) => {
                let text = "both `distance` and `timeGap` define the distance to keep, but only one of them is \
                            allowed";
                found.about(action, "timeGap", text);
            }
            (false, false) => {
                let text = "neither `distance` nor `timeGap` defines the distance to keep; one of them is required";
                found.about(action, "", text);
            }
            _ => {}
        }
    }
}
