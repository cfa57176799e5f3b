//! Links of roads in virtual junctions.

use foldhash::HashSet;
use qcbus_opendrive::{JunctionType, Road, RoadLink, RoadMap};

/// Whether a link leads from a road of a virtual junction to the main road of that junction.
pub(crate) fn leads_to_main_road(map: &RoadMap<'_>, road: &Road<'_>, link: RoadLink<'_>) -> bool {
    let junction = road.junction().and_then(|id| map.junction(id));
    junction.is_some_and(|junction| {
        junction.kind() == Some(JunctionType::Virtual)
            && junction.main_road().is_some()
            && link.road_id() == junction.main_road()
    })
}

/// The ids of the roads that connections of virtual junctions name as connecting ones. That such a road names
/// another junction, or none, is said elsewhere: it is one of the virtual junction's all the same.
pub(crate) fn connecting_roads<'a>(map: &RoadMap<'a>) -> HashSet<&'a str> {
    let connections = map.connections();
    let connections =
        connections.filter(|(junction, _)| junction.kind() == Some(JunctionType::Virtual));
    connections
        .filter_map(|(_, connection)| connection.connecting_road())
        .collect()
}

/// Whether a road may be linked to a place within another: it belongs to a virtual junction, or to
/// one of which the file does not say what it is.
pub(crate) fn may_be_within(map: &RoadMap<'_>, road: &Road<'_>) -> bool {
    let Some(id) = road.junction() else {
        return false;
    };
    let kind = map.junction(id).map(|junction| junction.kind());
    !matches!(kind, Some(Some(kind)) if kind != JunctionType::Virtual)
}
