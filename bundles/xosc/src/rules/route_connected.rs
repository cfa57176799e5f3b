use crate::families::positions::metres;
use crate::families::routes::{is_for_vehicles, routes, stop, waypoints};
use crate::prelude::*;
use qcbus_openscenario::Way;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Maximum number of road stretches that are visited for all routes of a scenario.
const MOST: usize = 4_000_000;

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(network) = scenario.network().map() else {
        return;
    };
    let mut routes = routes(scenario)
        .filter(|route| is_for_vehicles(*route))
        .peekable();
    if routes.peek().is_none() {
        return;
    }
    let Some(ways) = network.ways() else {
        return;
    };
    let mut budget = MOST;
    for route in routes {
        let mut before = None;
        for (waypoint, position) in waypoints(route) {
            let here = position
                .and_then(|position| Some((position, network.with(|map| stop(position, map))?)));
            if let (Some((from, left)), Some((to, reached))) = (&before, &here) {
                match ways.between(left, reached, &mut budget) {
                    Way::Driven | Way::Unknown => {}
                    Way::Against => say(waypoint, *from, *to, true, found),
                    Way::None => say(waypoint, *from, *to, false, found),
                }
            }
            before = here;
        }
    }
}

fn say(
    waypoint: Element<'_, '_>,
    from: Element<'_, '_>,
    to: Element<'_, '_>,
    is_linked: bool,
    found: &mut Sink<'_>,
) {
    let (here, before) = (place(to), place(from));
    let text = if is_linked {
        format!(
            "this waypoint ({here}) can be reached from the one before it ({before}) only against the direction \
             of traffic"
        )
    } else {
        format!(
            "this waypoint ({here}) cannot be reached from the one before it ({before}), because no linked lanes \
             lead there"
        )
    };
    found
        .about(waypoint, "", text)
        .at(from.node(), "the waypoint before it")
        .maybe_fault(waypoint.parent().map(|route| fault_of(route.node())));
}

fn place(position: Element<'_, '_>) -> String {
    let text = |name| position.text(name).unwrap_or_default();
    let s = position.number("s").map_or(String::new(), metres);
    if position.is("LanePosition") {
        format!(
            "road `{}`, lane `{}`, s = {s}",
            text("roadId"),
            text("laneId")
        )
    } else {
        format!("road `{}`, s = {s}", text("roadId"))
    }
}
