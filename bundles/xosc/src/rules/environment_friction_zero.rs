use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_environment_friction_zero",
    uids: &["qcbus.dev:xosc:1.0.0:environment.friction_zero"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("environment_friction_zero.md"),
    run,
    ..Rule::DEFAULTS
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
