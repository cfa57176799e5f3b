//! What connections and the lanes of their connecting roads say about each other.

use foldhash::{HashMap, HashSet};
use qcbus_document::Node;
use qcbus_opendrive::{Connection, ContactPoint, JunctionType, Road, RoadEnd, RoadMap};

/// The connections of common junctions that lead from one road end to another, of which one says what another
/// leaves out: some tools write one for each lane.
pub(crate) struct Bundle<'a> {
    /// An end of the incoming road.
    pub from: RoadEnd,
    /// An end of the connecting road.
    pub to: RoadEnd,
    /// The first of the connections.
    pub connection: Connection<'a>,
    /// Their lane links: from, to.
    pub links: Vec<(i64, i64, Node<'a>)>,
}

/// The connections of common junctions by the road ends that they join, in document order. Only those whose
/// connecting road names the incoming one in turn: where the roads do not agree, lanes cannot.
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

/// What the connections say of connecting roads, to find the ends of which they say nothing.
pub(crate) struct Entries<'a> {
    /// Connecting roads, and at which of their ends a connection begins.
    ends: HashSet<(&'a str, Option<ContactPoint>)>,
    /// Incoming and connecting roads.
    roads: HashSet<(&'a str, &'a str)>,
    /// Connecting roads and their lanes to which a lane link leads.
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

    /// The road around a junction from which a connecting road goes on at an end, while no connection leads from
    /// there, but one along the connecting road the other way.
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

    /// Whether a lane link leads to a lane of a connecting road.
    pub fn leads_to(&self, road: &Road<'a>, lane: i64) -> bool {
        self.lanes.contains(&(road.id(), lane))
    }
}
