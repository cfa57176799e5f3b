//! Comparison of connections with the lane links of their connecting roads.

use crate::prelude::*;
use foldhash::{HashMap, HashSet};

/// All connections of common junctions between the same two road ends. They complete each other,
/// because some tools write one connection for each lane.
pub(crate) struct Bundle<'a> {
    /// End of the incoming road.
    pub from: RoadEnd,
    /// End of the connecting road.
    pub to: RoadEnd,
    /// The first of the connections.
    pub connection: Connection<'a>,
    /// The lane links of all these connections: from, to, element.
    pub links: Vec<(i64, i64, Node<'a>)>,
}

/// Groups the connections of common junctions by road ends, in document order. It skips connecting
/// roads without a link back to the incoming road, because then the lanes cannot agree.
pub(crate) fn bundles<'a>(map: &RoadMap<'a>) -> Vec<Bundle<'a>> {
    let mut places: HashMap<(RoadEnd, RoadEnd), usize> = HashMap::default();
    let mut bundles: Vec<Bundle<'a>> = Vec::new();
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Common) {
            continue;
        }
        let Some(contact) = map.connection_contact(junction, connection) else {
            continue;
        };
        let (from, to) = (contact.from, contact.to);
        let road = map.road_at(to.road);
        let linked = road.and_then(|road| map.linked_end(road, to.end));
        if linked.is_none_or(|linked| linked.to != from) {
            continue;
        }
        let place = *places.entry((from, to)).or_insert(bundles.len());
        if place == bundles.len() {
            bundles.push(Bundle {
                from,
                to,
                connection,
                links: Vec::new(),
            });
        }
        let links = connection.lane_links();
        let links = links.filter_map(|link| Some((link.from()?, link.to()?, link.node())));
        if let Some(bundle) = bundles.get_mut(place) {
            bundle.links.extend(links);
        }
    }
    bundles
}

/// The entries of connections about connecting roads, for finding road ends without an entry.
pub(crate) struct Entries<'a> {
    /// Connecting roads, each with the end at which a connection begins.
    ends: HashSet<(&'a str, Option<ContactPoint>)>,
    /// Pairs of incoming and connecting road.
    roads: HashSet<(&'a str, &'a str)>,
    /// Connecting roads, each with a lane that is the target of a lane link.
    lanes: HashSet<(&'a str, i64)>,
}

impl<'a> Entries<'a> {
    pub fn of(map: &RoadMap<'a>) -> Entries<'a> {
        let mut entries = Entries {
            ends: HashSet::default(),
            roads: HashSet::default(),
            lanes: HashSet::default(),
        };
        for (_, connection) in map.connections() {
            let Some(id) = connection.connecting_road() else {
                continue;
            };
            entries.ends.insert((id, connection.contact_point()));
            let incoming = connection.incoming_road();
            entries
                .roads
                .extend(incoming.map(|incoming| (incoming, id)));
            let lanes = connection.lane_links().filter_map(|link| link.to());
            entries.lanes.extend(lanes.map(|lane| (id, lane)));
        }
        entries
    }

    /// Returns the road end outside the junction from which a connection is missing. The connecting
    /// road is linked to it at `end`, but only the opposite direction has a connection.
    pub fn missing<'m>(
        &self,
        map: &'m RoadMap<'a>,
        road: &Road<'a>,
        end: ContactPoint,
    ) -> Option<(&'m Road<'a>, ContactPoint)> {
        let junction = map.junction(road.junction()?)?;
        let at = |end| self.ends.contains(&(road.id(), end));
        if junction.kind() != Some(JunctionType::Common)
            || !at(Some(end.other()))
            || at(Some(end))
            || at(None)
        {
            return None;
        }
        let linked = map.linked_end(road, end)?.to;
        let incoming = map.road_at(linked.road)?;
        let named = self.roads.contains(&(incoming.id(), road.id()));
        (incoming.junction().is_none() && !named).then_some((incoming, linked.end))
    }

    /// Checks whether a lane link leads to this lane of the connecting road.
    pub fn leads_to(&self, road: &Road<'a>, lane: i64) -> bool {
        self.lanes.contains(&(road.id(), lane))
    }
}
