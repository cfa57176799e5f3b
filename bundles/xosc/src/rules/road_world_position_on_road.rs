use crate::families::positions::{metres, moved, owner};
use crate::prelude::*;
use qcbus_openscenario::RoadNetwork;
use qcbus_openscenario::RoadsNearby;
use qcbus_openscenario::places::Origins;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    params: &[DISTANCE],
    run,
    ..Rule::after(READABLE)
};

const DISTANCE: Param = Param::number(
    "distance",
    20.0,
    "m",
    "largest distance of a vehicle from the nearest lane that is accepted",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(network) = scenario.network().map() else {
        return;
    };
    let distance = found.number(&DISTANCE);
    for position in scenario.elements_everywhere("WorldPosition") {
        let places = ["TeleportAction", "AcquirePositionAction"];
        if !owner(position).is_some_and(|owner| places.contains(&owner.name())) {
            continue;
        }
        let vehicle = moved(position).unwrap_or_default();
        let vehicle = vehicle
            .iter()
            .find(|entity| entity.kind() == EntityKind::Vehicle);
        let Some((x, y)) = position.number("x").zip(position.number("y")) else {
            continue;
        };
        let Some(vehicle) = vehicle else { continue };
        let nearby = network.nearby();
        if nearby.is_empty() || nearby.is_near(x, y, distance) {
            continue;
        }
        let text = format!(
            "the position of the vehicle `{}`, x = {}, y = {}, is more than {} away from every lane of the road \
             network",
            vehicle.name(),
            metres(x),
            metres(y),
            metres(distance)
        );
        let z = position.number("z").unwrap_or(0.0);
        let level = level(nearby, x, y, distance);
        found.about(position, "", text).level(level).point(x, y, z);
    }
    network.with(|map| relative_to_others(scenario, (network, map), distance, found));
}

/// Reports vehicles that start away from all roads because of a relative position.
fn relative_to_others(
    scenario: &Scenario<'_>,
    (network, map): (&RoadNetwork, &RoadMap<'_>),
    distance: f64,
    found: &mut Sink<'_>,
) {
    let origins = Origins::of(scenario, Some(map));
    for (at, start) in origins.starts.iter().enumerate() {
        let position = start.position;
        let is_free =
            ["RelativeWorldPosition", "RelativeObjectPosition"].contains(&position.name());
        let entity = scenario.entities().object(&start.name);
        let is_vehicle = entity.is_some_and(|entity| entity.kind() == EntityKind::Vehicle);
        let place = (is_free && is_vehicle).then(|| origins.place(at)).flatten();
        let Some(place) = place else { continue };
        let nearby = network.nearby();
        if nearby.is_empty() || nearby.is_near(place.x, place.y, distance) {
            continue;
        }
        let text = format!(
            "the position of the vehicle `{}`, which is x = {}, y = {}, is more than {} away from every lane of \
             the road network",
            start.name,
            metres(place.x),
            metres(place.y),
            metres(distance)
        );
        let z = place.z.unwrap_or(0.0);
        let level = level(nearby, place.x, place.y, distance);
        let finding = found.about(position, "", text).level(level);
        finding.point(place.x, place.y, z);
    }
}

/// Returns the level. There may be a yard beside a road. A place far from all roads is on another
/// map.
fn level(nearby: &RoadsNearby, x: f64, y: f64, distance: f64) -> Level {
    if nearby.is_near(x, y, 5.0 * distance) {
        Level::Information
    } else {
        Level::Warning
    }
}
