use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for axles in scenario.elements("Axles") {
        if axles.child("FrontAxle").is_none() {
            let text = "these `Axles` have no `FrontAxle`, which the minimum subset requires";
            found.issue(axles.node(), text);
        }
    }
}
