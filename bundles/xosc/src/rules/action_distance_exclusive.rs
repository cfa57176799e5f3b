use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
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
