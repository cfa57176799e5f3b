//! Connected parts of the road network.

use super::routes::is_route;
use crate::prelude::*;
use foldhash::HashMap;

/// The roads of a map, joined wherever the file relates them in any way.
pub(crate) struct Parts {
    above: Vec<usize>,
}

/// A set of connected roads.
pub(crate) struct Piece {
    /// Index in the map of its first road with a lane for vehicles.
    pub first: usize,
    /// Number of roads with such lanes.
    pub roads: usize,
    /// Total length of these roads in metres.
    pub length: f64,
}

impl Parts {
    /// Joins the roads and junctions that refer to each other.
    pub fn of(map: &RoadMap<'_>) -> Parts {
        let roads = map.roads().len();
        let junctions = map.junctions().len();
        let mut parts = Parts {
            above: (0..roads + junctions).collect(),
        };
        for road in map.roads() {
            for end in ContactPoint::BOTH {
                if let Some(contact) = map.linked_end(road, end) {
                    parts.join(road.index(), Some(contact.to.road));
                    continue;
                }
                let Some(link) = road.link(end) else { continue };
                let linked = link.road_id().and_then(|id| map.road(id));
                let junction = link.junction_id().and_then(|id| map.junction(id));
                parts.join(road.index(), linked.map(Road::index));
                parts.join(road.index(), junction.map(|it| roads + it.index()));
            }
            let junction = map.junction_of(road);
            parts.join(road.index(), junction.map(|it| roads + it.index()));
        }
        for (junction, connection) in map.connections() {
            let at = roads + junction.index();
            if let Some(contact) = map.connection_contact(junction, connection) {
                parts.join(at, Some(contact.from.road));
                parts.join(at, Some(contact.to.road));
                continue;
            }
            for id in [connection.incoming_road(), connection.target_road()] {
                let road = id.and_then(|id| map.road(id));
                parts.join(at, road.map(Road::index));
            }
        }
        for junction in map.junctions() {
            let crossed = junction.cross_paths();
            let crossed = crossed
                .flat_map(|one| [one.crossing_road(), one.road_at_start(), one.road_at_end()]);
            let sections = junction.road_sections().map(|one| one.road_id());
            let named = crossed.chain(sections).chain([junction.main_road()]);
            for road in named.flatten().filter_map(|id| map.road(id)) {
                parts.join(roads + junction.index(), Some(road.index()));
            }
        }
        parts
    }

    /// Returns the root of a set and shortens the path to it.
    fn root(&mut self, mut at: usize) -> usize {
        while let Some(above) = self.above.get(at).copied().filter(|above| *above != at) {
            let further = self.above.get(above).copied().unwrap_or(above);
            if let Some(slot) = self.above.get_mut(at) {
                *slot = further;
            }
            at = further;
        }
        at
    }

    fn join(&mut self, one: usize, other: Option<usize>) {
        let Some(other) = other else { return };
        let (one, other) = (self.root(one), self.root(other));
        if let Some(slot) = self.above.get_mut(one.max(other)) {
            *slot = one.min(other);
        }
    }

    /// Returns the pieces with lanes for vehicles, in the order of their first roads.
    pub fn pieces(mut self, map: &RoadMap<'_>) -> Vec<Piece> {
        let mut places: HashMap<usize, usize> = HashMap::default();
        let mut pieces: Vec<Piece> = Vec::new();
        for road in map.roads() {
            if !road.sections().any(|section| section.lanes().any(is_route)) {
                continue;
            }
            let root = self.root(road.index());
            let place = *places.entry(root).or_insert(pieces.len());
            if place == pieces.len() {
                pieces.push(Piece {
                    first: road.index(),
                    roads: 0,
                    length: 0.0,
                });
            }
            if let Some(piece) = pieces.get_mut(place) {
                piece.roads += 1;
                piece.length += road.length().unwrap_or(0.0).max(0.0);
            }
        }
        pieces
    }
}
