use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_vehicle_performance_attributes",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_vehicle_performance_attributes"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_vehicle_performance_attributes.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let attributes = ["maxAccelerationRate", "maxDecelerationRate"];
    minsubset::without(scenario, "Performance", &attributes, found);
}
