use std::cell::OnceCell;

use qcbus_openscenario::Scenario;
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::positions::listed;
use crate::families::roads_nearby::RoadsNearby;
use crate::families::routes::{is_for_vehicles, routes, waypoints};
use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_routing_ambiguous_route_waypoints",
    uids: &["asam.net:xosc:1.0.0:routing.ambiguous_route_waypoints"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("routing_ambiguous_route_waypoints.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(map) = scenario.network().map() else {
        return;
    };
    let nearby = OnceCell::new();
    for route in routes(scenario) {
        for (_, position) in waypoints(route) {
            let world = position.filter(|position| position.is("WorldPosition"));
            let Some(position) = world else { continue };
            let Some((x, y)) = position.number("x").zip(position.number("y")) else {
                continue;
            };
            let roads = nearby.get_or_init(|| RoadsNearby::of(map)).roads_at(x, y);
            let text = match roads.len() {
                0 if is_for_vehicles(route) => {
                    "the waypoint is a `WorldPosition` on no lane of the road network; a `LanePosition` says \
                     which road the route takes"
                        .to_owned()
                }
                0 | 1 => continue,
                count => format!(
                    "the waypoint is a `WorldPosition` on the lanes of {count} roads, {}; a `LanePosition` \
                     says which one the route takes",
                    listed(roads.iter().copied())
                ),
            };
            found
                .about(position, "", text)
                .point(x, y, position.number("z").unwrap_or(0.0));
        }
    }
}
