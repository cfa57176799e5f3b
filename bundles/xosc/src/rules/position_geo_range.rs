use crate::families::ranges;
use crate::families::ranges::tables::GEO;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    versions: "1.1..",
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:position.geo_range"];

const UIDS: [&str; OWN.len() + GEO.len()] = ranges::uids(&OWN, GEO);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_by_element(scenario, GEO, found);
    // Before 1.2 the schema requires both.
    if scenario.version() >= (1, 2) {
        both_given(scenario, found);
    }
}

/// Checks that latitude and longitude are given. Each may be given in radians or in degrees, so no
/// schema can require one of them.
fn both_given(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for position in scenario.elements_everywhere("GeoPosition") {
        for (degrees, radians) in [("latitudeDeg", "latitude"), ("longitudeDeg", "longitude")] {
            if !position.has(degrees) && !position.has(radians) {
                let text = format!(
                    "`GeoPosition` has no {radians}; use `{degrees}` in degrees or `{radians}` in radians"
                );
                found.about(position, degrees, text);
            }
        }
    }
}
