//! What connections and the lanes of their connecting roads say about each other.

use foldhash::HashMap;
use qcbus_document::Node;
use qcbus_opendrive::{Connection, JunctionType, RoadEnd, RoadMap};

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
