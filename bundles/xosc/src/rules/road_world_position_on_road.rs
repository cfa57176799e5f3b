use qcbus_openscenario::{EntityKind, Scenario};
use qcbus_sdk::{Level, Param, Rule, Sink};

use crate::families::positions::{metres, moved, owner};
use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_road_world_position_on_road",
    uids: &["qcbus.dev:xosc:1.0.0:road.world_position_on_road"],
    level: Level::Information,
    after: super::READABLE,
    params: &[DISTANCE],
    page: include_str!("road_world_position_on_road.md"),
    run,
    ..Rule::DEFAULTS
};

const DISTANCE: Param = Param::number(
    "distance",
    20.0,
    "m",
    "a vehicle may be so far away from the next lane",
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
            "the place of the vehicle `{}`, x = {}, y = {}, is more than {} away from every lane of the road \
             network",
            vehicle.name(),
            metres(x),
            metres(y),
            metres(distance)
        );
        let z = position.number("z").unwrap_or(0.0);
        found.about(position, "", text).point(x, y, z);
    }
}
