use crate::families::positions::road_of;
use crate::families::routes::{routes, waypoints};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    scenario.on_map(|map| look(scenario, map, found));
}

fn look(scenario: &Scenario<'_>, map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for route in routes(scenario) {
        for (_, position) in waypoints(route) {
            let Some(position) = position else { continue };
            let Some(road) = road_of(position, map) else {
                continue;
            };
            let Some(junction) = road.junction() else {
                continue;
            };
            let text = format!(
                "the waypoint is on the road `{}`, which is in the junction `{junction}`; roads of a junction \
                 overlap, so waypoints should be before and after it",
                road.id()
            );
            found
                .about(position, "roadId", text)
                .at(road.node(), "the road")
                .fault("waypoints in junctions");
        }
    }
}
