use std::cell::OnceCell;

use qcbus_opendrive::RoadMap;
use qcbus_openscenario::{Element, Scenario};
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::positions::{metres, road_of, shown, station};
use crate::families::routes::waypoints;
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
    let all_roads = OnceCell::new();
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
        let (Some(at), Some(length)) = (place.number("pathS"), Length::of(route, &all_roads))
        else {
            continue;
        };
        let most = length.most;
        if at > most + 1e-3 + most * 1e-6 {
            let (long, why) = if length.is_exact {
                ("", "its waypoints all lie on one road")
            } else {
                ("at most ", "all roads together allow no more")
            };
            let text = format!(
                "`pathS` is {}, but the route is {long}{} long: {why}",
                shown(place, "pathS", &metres(at)),
                metres(most)
            );
            found
                .about(place, "pathS", text)
                .at(route.node(), "the route");
        }
    }
}

/// How long a route may be.
struct Length {
    most: f64,
    is_exact: bool,
}

impl Length {
    /// The length, where it does not depend on the way that a simulator finds because all waypoints
    /// follow each other in one direction of one road; else no leg passes any road twice.
    fn of(route: Element<'_, '_>, all_roads: &OnceCell<Option<f64>>) -> Option<Length> {
        if route.flag("closed")? {
            return None;
        }
        let scenario = route.scenario();
        scenario.on_map(|map| Length::on(map, route, all_roads))?
    }

    fn on(
        map: &RoadMap<'_>,
        route: Element<'_, '_>,
        all_roads: &OnceCell<Option<f64>>,
    ) -> Option<Length> {
        let mut stations = Vec::new();
        let mut roads = Vec::new();
        for (_, position) in waypoints(route) {
            let position = position?;
            let road = road_of(position, map)?;
            roads.push(road.index());
            stations.push(station(position, road)?);
        }
        let (first, last) = (stations.first()?, stations.last()?);
        let rises = |pair: &[f64]| pair.first() <= pair.last();
        let falls = |pair: &[f64]| pair.first() >= pair.last();
        let one_way = stations.windows(2).all(rises) || stations.windows(2).all(falls);
        let one_road = roads.windows(2).all(|pair| pair.first() == pair.last());
        let legs = stations.len().checked_sub(1).filter(|legs| *legs > 0)?;
        if one_way && one_road {
            return Some(Length {
                most: (last - first).abs(),
                is_exact: true,
            });
        }
        let all = || map.roads().iter().map(|road| road.length()).sum();
        Some(Length {
            most: (*all_roads.get_or_init(all))? * f64::from(u32::try_from(legs).ok()?),
            is_exact: false,
        })
    }
}
