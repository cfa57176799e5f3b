//! Routes and their waypoints.

use crate::families::positions::{lane_of, moved, road_of, station};
use crate::prelude::*;
use qcbus_openscenario::Stop;

/// Returns the waypoints of a route and the positions in their `Position`.
pub(crate) fn waypoints<'m, 'd>(
    route: Element<'m, 'd>,
) -> impl Iterator<Item = (Element<'m, 'd>, Option<Element<'m, 'd>>)> {
    route.children_named("Waypoint").map(|waypoint| {
        let position = waypoint.child("Position");
        (
            waypoint,
            position.and_then(|position| position.children().next()),
        )
    })
}

/// Returns all routes, in the document and in catalogs.
pub(crate) fn routes<'m, 'd>(scenario: &'m Scenario<'d>) -> impl Iterator<Item = Element<'m, 'd>> {
    scenario.elements_everywhere("Route")
}

/// Checks whether all entities on a route are known to be vehicles.
pub(crate) fn is_for_vehicles(route: Element<'_, '_>) -> bool {
    moved(route).is_some_and(|entities| {
        !entities.is_empty()
            && entities
                .iter()
                .all(|entity| entity.kind() == EntityKind::Vehicle)
    })
}

/// Returns the stop of a waypoint on the map.
pub(crate) fn stop(position: Element<'_, '_>, map: &RoadMap<'_>) -> Option<Stop> {
    let road = road_of(position, map)?;
    if position.is("LanePosition") {
        let (lane, s) = lane_of(position, road)?;
        return Some(Stop::in_lane(lane, s));
    }
    Stop::on_road(road, station(position, road)?)
}
