//! Connections of junctions (OpenDRIVE 1.9, 12.3 and 12.4).

use super::faults::OfFault as _;
use std::collections::BTreeMap;

use super::on_road::{MAX_PLACES, OnRoad};
use crate::prelude::*;

/// Returns groups of connections of a junction with the same `key`, in the order of the keys. Only
/// groups with several connections are included.
pub(crate) fn repeated<'a, K: Ord>(
    junction: &Junction<'a>,
    key: impl Fn(&Connection<'a>) -> Option<K>,
) -> Vec<(K, Vec<Connection<'a>>)> {
    let mut groups: BTreeMap<K, Vec<Connection<'a>>> = BTreeMap::new();
    for connection in junction.connections().filter(|one| !one.is_virtual()) {
        if let Some(key) = key(&connection) {
            groups.entry(key).or_default().push(connection);
        }
    }
    groups.retain(|_, connections| connections.len() > 1);
    groups.into_iter().collect()
}

/// Reports connections of which only one is allowed, in the middle of their target road.
pub(crate) fn report_repeated(
    map: &RoadMap<'_>,
    text: String,
    connections: &[Connection<'_>],
    found: &mut Sink<'_>,
) {
    let [first, rest @ ..] = connections else {
        return;
    };
    let mut finding = found.issue(first.node(), text).here("the first connection");
    if let Some(road) = first.target_road().and_then(|id| map.road(id)) {
        finding = finding.on(road, road.length().unwrap_or(0.0) / 2.0, 0.0);
    }
    for connection in rest.iter().take(MAX_PLACES) {
        finding = finding.at(connection.node(), "a further connection");
    }
}

/// Reports connections with `contactPoint="…"` whose connecting road is linked at that end to
/// another road than the incoming one.
///
/// If a connecting road has no link at that end, the rules about its links report it. The exception
/// is a road that meets the incoming road at its other end.
pub(crate) fn contact_point_is_right(map: &RoadMap<'_>, end: ContactPoint, found: &mut Sink<'_>) {
    for (_, connection) in map.connections() {
        if connection.contact_point() != Some(end) || connection.is_virtual() {
            continue;
        }
        let roads = connection.connecting_road().zip(connection.incoming_road());
        let Some((road, incoming)) = roads.and_then(|(to, from)| Some((map.road(to)?, from)))
        else {
            continue;
        };
        let linked = |end: ContactPoint| road.link(end).and_then(|link| link.road_id());
        let says = match (linked(end), linked(end.other())) {
            (Some(here), _) if here == incoming => continue,
            (Some(here), _) => format!(
                "the {} of road `{}` is road `{here}`",
                end.link_name(),
                road.id()
            ),
            (None, Some(there)) if there == incoming => format!(
                "road `{incoming}` is the {} of road `{}`",
                end.other().link_name(),
                road.id()
            ),
            (None, _) => continue,
        };
        report(connection, road, end, &says, found);
    }
}

fn report(
    connection: Connection<'_>,
    road: &Road<'_>,
    end: ContactPoint,
    says: &str,
    found: &mut Sink<'_>,
) {
    let text = format!(
        "`contactPoint=\"{end}\"` says that the incoming road `{}` meets the {end} of the connecting \
         road, but {says}",
        connection.incoming_road().unwrap_or_default()
    );
    let place = Place::attribute_or_node(connection.node(), "contactPoint");
    let finding = found
        .issue(place, text)
        .at_end(road, end)
        .of_junction(connection.node());
    match road.link_node() {
        Some(link) => finding.at(link, "the link of the connecting road"),
        None => finding,
    };
}
