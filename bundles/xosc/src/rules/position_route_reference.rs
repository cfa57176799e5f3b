use std::cell::OnceCell;

use crate::families::positions::{
    find_lane, lane_id, lane_of, metres, road_of, section_of, shown, station,
};
use crate::families::relative::Reach;
use crate::families::routes::waypoints;
use crate::prelude::*;
use qcbus_opendrive::TrafficRule;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    scenario.on_map(|map| look(scenario, map, found));
}

fn look(scenario: &Scenario<'_>, map: &RoadMap<'_>, found: &mut Sink<'_>) {
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
        let (Some(at), Some(length)) = (place.number("pathS"), Length::of(route, map, &all_roads))
        else {
            continue;
        };
        let most = length.most;
        if at > most + 1e-3 + most * 1e-6 {
            let (long, why) = if length.is_exact {
                ("", "all its waypoints are on one road")
            } else {
                ("at most ", "the roads do not allow more")
            };
            let text = format!(
                "`pathS` is {}, but the route is {long}{} long; {why}",
                shown(place, "pathS", &metres(at)),
                metres(most)
            );
            found
                .about(place, "pathS", text)
                .at(route.node(), "the route");
        } else if let Some((road, from, sign)) = length.line {
            beside(place, road, from + sign * at, found);
        }
    }
}

/// Checks the attributes of a place besides `pathS`, if the station is known.
fn beside(place: Element<'_, '_>, road: &Road<'_>, s: f64, found: &mut Sink<'_>) {
    if let Some(text) = place.text("laneId") {
        let id = lane_id(&text).filter(|id| *id != 0);
        // A lane that exists nowhere is reported elsewhere.
        let is_somewhere = road
            .sections()
            .any(|section| id.is_some_and(|id| section.lane(id).is_some()));
        if let Some(id) = id.filter(|_| is_somewhere)
            && let LaneAt::None(section) = find_lane(road, s, id)
        {
            let text = format!(
                "`laneId` is `{id}`, but the road `{}` of the route has no such lane at s = {}",
                road.id(),
                metres(s)
            );
            let node = section.section().node();
            found
                .about(place, "laneId", text)
                .at(node, "the lane section");
        }
    }
    let edge = |side| {
        let section = section_of(road, side, s)?;
        section.edge_t(side, s - section.s()?)
    };
    let edges = edge(Side::Right).zip(edge(Side::Left));
    if let (Some(t), Some((right, left))) = (place.number("t"), edges)
        && t.abs() > left.max(-right) + 1e-3
    {
        let text = format!(
            "`t` is {}, but the lanes of the road `{}` of the route extend from {} to {} at s = {}",
            shown(place, "t", &metres(t)),
            road.id(),
            metres(right),
            metres(left),
            metres(s)
        );
        found.about(place, "t", text).at(road.node(), "the road");
    }
}

/// Maximum length of a route.
struct Length<'w, 'r> {
    most: f64,
    is_exact: bool,
    /// The road of the route, its start station and its direction.
    line: Option<(&'w Road<'r>, f64, f64)>,
}

impl<'w, 'r> Length<'w, 'r> {
    /// Returns the length. It is exact if all waypoints follow each other in one direction of one
    /// road. Then it does not depend on the path that a simulator finds. Otherwise no leg passes
    /// any road twice.
    fn of(
        route: Element<'_, '_>,
        map: &'w RoadMap<'r>,
        all_roads: &OnceCell<Option<f64>>,
    ) -> Option<Length<'w, 'r>> {
        if route.flag("closed")? {
            return None;
        }
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
            let road = map.roads().get(*roads.first()?)?;
            return Some(Length {
                most: (last - first).abs(),
                is_exact: true,
                line: Some((road, *first, (last - first).signum())),
            });
        }
        let all = || map.roads().iter().map(|road| road.length()).sum();
        let most = (*all_roads.get_or_init(all))? * f64::from(u32::try_from(legs).ok()?);
        let onward = onward(route, map);
        Some(Length {
            most: onward.map_or(most, |onward| onward.min(most)),
            is_exact: false,
            line: None,
        })
    }
}

/// Returns the maximum distance from the first waypoint to the last. It is the farthest distance
/// from the first waypoint, without the rest of the last one's road. Returns `None` if roads form a
/// circle, or if the initial direction is unknown.
fn onward<'d>(route: Element<'_, 'd>, map: &RoadMap<'_>) -> Option<f64> {
    let ends = |position: Element<'_, 'd>| {
        let road = road_of(position, map).filter(|_| position.is("LanePosition"))?;
        let (lane, s) = lane_of(position, road)?;
        let is_right = lane.id()? < 0;
        let is_left_hand = road.traffic_rule() == Some(TrafficRule::LeftHand);
        Some((road, s, is_right != is_left_hand))
    };
    let mut positions = waypoints(route).map(|(_, position)| position);
    let (road, s, along) = ends(positions.next()??)?;
    let (last, at, onward) = ends(positions.last()??)?;
    let rest = if onward { last.length()? - at } else { at };
    Some(Reach::of(map)?.from(road, s, along)? - rest)
}
