use crate::families::positions::listed;
use crate::families::routes::{is_for_vehicles, routes, waypoints};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(network) = scenario.network().map() else {
        return;
    };
    for route in routes(scenario) {
        for (_, position) in waypoints(route) {
            let world = position.filter(|position| position.is("WorldPosition"));
            let Some(position) = world else { continue };
            let Some((x, y)) = position.number("x").zip(position.number("y")) else {
                continue;
            };
            let (count, roads) = network.with(|map| {
                let roads = network.nearby().roads_at(map, x, y);
                (roads.len(), listed(roads.iter().map(|road| road.id())))
            });
            let text = match count {
                0 if is_for_vehicles(route) => {
                    "the waypoint is a `WorldPosition` that is on no lane of the road network; use a \
                     `LanePosition` to define which road the route takes"
                        .to_owned()
                }
                0 | 1 => continue,
                count => format!(
                    "the waypoint is a `WorldPosition` that is on the lanes of {count} roads, {roads}; use a \
                     `LanePosition` to define which road the route takes"
                ),
            };
            found
                .about(position, "", text)
                .point(x, y, position.number("z").unwrap_or(0.0));
        }
    }
}
