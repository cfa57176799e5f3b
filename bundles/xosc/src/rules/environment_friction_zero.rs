use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for road in scenario.elements_everywhere("RoadCondition") {
        if road.number("frictionScaleFactor") == Some(0.0) {
            let text = "`frictionScaleFactor` of `RoadCondition` is zero; without friction no vehicle can drive, \
                        steer or brake; 1 is the road as it is, ice is about 0.1";
            found.about(road, "frictionScaleFactor", text);
        }
    }
}
