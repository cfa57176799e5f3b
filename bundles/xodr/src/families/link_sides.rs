//! Checks that the two sides of a road link agree.

use crate::prelude::*;
use foldhash::HashSet;

/// Checks whether a road belongs to a virtual junction. Such junctions do not split roads, so the
/// surrounding roads need no link to them.
pub(crate) fn in_virtual_junction(map: &RoadMap<'_>, road: &Road<'_>) -> bool {
    let junction = map.junction_of(road);
    junction.is_some_and(|junction| junction.kind() == Some(JunctionType::Virtual))
}

/// Checks whether the link on the other side leads back to the road itself or to its junction.
pub(crate) fn agrees(
    map: &RoadMap<'_>,
    (road, end): (&Road<'_>, ContactPoint),
    (other, contact): (&Road<'_>, ContactPoint),
) -> bool {
    let Some(back) = other.link(contact) else {
        return false;
    };
    if back.road_id() == Some(road.id()) {
        return back.contact_point().is_none_or(|contact| contact == end);
    }
    let Some(junction) = back.junction_id() else {
        return false;
    };
    let uses = |junction: &Junction<'_>| {
        let mut connections = junction.connections();
        connections.any(|connection| connection.connecting_road() == Some(road.id()))
    };
    road.junction() == Some(junction) || map.junctions_with_id(junction).any(uses)
}

/// Roads that the junctions mention: index of the junction, id of the road, and end of the road if
/// given.
pub(crate) struct Known<'a>(HashSet<(usize, &'a str, Option<ContactPoint>)>);

impl<'a> Known<'a> {
    /// Collects the roads of the connections and cross paths of all junctions.
    pub fn by(map: &RoadMap<'a>) -> Known<'a> {
        let mut known = HashSet::default();
        for junction in map.junctions() {
            let at = junction.index();
            for connection in junction.connections() {
                let named = [connection.incoming_road(), connection.linked_road()];
                known.extend(named.into_iter().flatten().map(|id| (at, id, None)));
                let connecting = connection.connecting_road().and_then(|id| map.road(id));
                let links = ContactPoint::BOTH.map(|end| connecting?.link(end));
                let reached =
                    |link: RoadLink<'a>| Some((at, link.road_id()?, link.contact_point()));
                known.extend(links.into_iter().flatten().filter_map(reached));
            }
            for path in junction.cross_paths() {
                let named = [path.road_at_start(), path.road_at_end()];
                known.extend(named.into_iter().flatten().map(|id| (at, id, None)));
            }
        }
        Known(known)
    }

    /// Checks whether a junction mentions this road end, as virtual junctions and crossings need
    /// not.
    pub fn contains(&self, junction: &Junction<'a>, road: &Road<'a>, end: ContactPoint) -> bool {
        let cuts = matches!(
            junction.kind(),
            Some(JunctionType::Common | JunctionType::Direct)
        );
        let entry = |end| (junction.index(), road.id(), end);
        !cuts || self.0.contains(&entry(None)) || self.0.contains(&entry(Some(end)))
    }
}
