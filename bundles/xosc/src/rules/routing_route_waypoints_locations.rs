use crate::families::positions::road_of;
use crate::families::routes::{routes, waypoints};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_routing_route_waypoints_locations",
    uids: &["asam.net:xosc:1.0.0:routing.route_waypoints_locations"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("routing_route_waypoints_locations.md"),
    run,
    ..Rule::DEFAULTS
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
                .at(road.node(), "the road");
        }
    }
}
