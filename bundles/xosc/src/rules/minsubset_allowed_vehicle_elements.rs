use crate::families::minsubset;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
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
