use crate::families::ranges;
use crate::families::ranges::tables::GEO;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_geo_range",
    uids: &UIDS,
    versions: "1.1..",
    after: super::READABLE,
    page: include_str!("position_geo_range.md"),
    run,
    ..Rule::DEFAULTS
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:position.geo_range"];

const UIDS: [&str; OWN.len() + GEO.len()] = ranges::uids(&OWN, GEO);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, GEO, found);
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
