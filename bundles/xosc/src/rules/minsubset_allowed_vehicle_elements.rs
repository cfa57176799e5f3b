use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_allowed_vehicle_elements",
    uids: &["asam.net:xosc:1.3.0:minsubset.allowed_vehicle_elements"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_allowed_vehicle_elements.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let optional = ["Properties", "Trailer", "TrailerCoupler", "TrailerHitch"];
    for vehicle in scenario.elements("Vehicle") {
        for part in vehicle.children() {
            if optional.contains(&part.name()) {
                minsubset::outside(
                    part,
                    "a vehicle may have only what the standard requires",
                    found,
                );
            }
        }
    }
}
