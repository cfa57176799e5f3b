use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_vehicle_must_contain_front_axle",
    uids: &["asam.net:xosc:1.3.0:minsubset.vehicle_must_contain_front_axle"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_vehicle_must_contain_front_axle.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for axles in scenario.elements("Axles") {
        if axles.child("FrontAxle").is_none() {
            let text = "these `Axles` have no `FrontAxle`, which the minimum subset requires";
            found.issue(axles.node(), text);
        }
    }
}
