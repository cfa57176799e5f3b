use crate::families::routes::{routes, waypoints};
use crate::prelude::*;
use qcbus_openscenario::Version;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Last version with a schema that counts waypoints.
const LAST_SCHEMA: Version = (1, 3);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for route in routes(scenario) {
        // Each file is checked with the schema of its own header, including files with catalog
        // entries.
        let stated = route.stated_version();
        if stated.is_some_and(|version| version <= LAST_SCHEMA) {
            continue;
        }
        let count = waypoints(route).take(2).count();
        if count < 2 {
            let there = if count == 0 {
                "no waypoint"
            } else {
                "one waypoint"
            };
            let text = format!(
                "the route has {there}; it leads from one waypoint to the next, so it needs at least two"
            );
            found.about(route, "", text);
        }
    }
}
