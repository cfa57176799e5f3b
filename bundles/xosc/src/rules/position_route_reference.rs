use qcbus_openscenario::{Element, Scenario};
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::positions::shown;
use crate::families::positions::{metres, road_of, station};
use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_route_reference",
    uids: &["qcbus.dev:xosc:1.0.0:position.route_reference"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("position_route_reference.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for position in scenario.elements_everywhere("RoutePosition") {
        let place = position.child("InRoutePosition");
        let place = place.and_then(|place| {
            let mut kinds = place.children();
            kinds.find(|kind| ["FromRoadCoordinates", "FromLaneCoordinates"].contains(&kind.name()))
        });
        let route = position.child("RouteRef");
        let route = route.and_then(|reference| reference.child_or_entry(&["Route"]));
        let (Some(place), Some(route)) = (place, route) else {
            continue;
        };
        let (Some(at), Some(length)) = (place.number("pathS"), length(route)) else {
            continue;
        };
        if at > length + 1e-3 + length * 1e-6 {
            let text = format!(
                "`pathS` is {}, but the route is {} long: its waypoints all lie on one road",
                shown(place, "pathS", &metres(at)),
                metres(length)
            );
            found
                .about(place, "pathS", text)
                .at(route.node(), "the route");
        }
    }
}

/// How long a route is, where that can be said without knowing which way it takes: all its waypoints
/// follow each other in one direction of one road.
fn length(route: Element<'_, '_>) -> Option<f64> {
    if route.flag("closed")? {
        return None;
    }
    let map = route.scenario().network().map()?;
    let mut stations = Vec::new();
    let mut only = None;
    for waypoint in route.children_named("Waypoint") {
        let position = waypoint.child("Position")?.children().next()?;
        let road = road_of(position, map)?;
        if *only.get_or_insert(road.index()) != road.index() {
            return None;
        }
        stations.push(station(position, road)?);
    }
    let (first, last) = (stations.first()?, stations.last()?);
    let rises = |pair: &[f64]| pair.first() <= pair.last();
    let falls = |pair: &[f64]| pair.first() >= pair.last();
    let one_way = stations.windows(2).all(rises) || stations.windows(2).all(falls);
    (one_way && stations.len() > 1).then_some((last - first).abs())
}
