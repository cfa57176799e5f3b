//! Links of roads in virtual junctions.

use crate::prelude::*;
use foldhash::HashSet;

/// Checks whether a link leads from a road of a virtual junction to its main road.
pub(crate) fn leads_to_main_road(map: &RoadMap<'_>, road: &Road<'_>, link: RoadLink<'_>) -> bool {
    let junction = map.junction_of(road);
    junction.is_some_and(|junction| {
        junction.kind() == Some(JunctionType::Virtual)
            && junction.main_road().is_some()
            && link.road_id() == junction.main_road()
    })
}

/// Returns the connecting roads of virtual junctions by id. They belong to the virtual junction
/// even if they name another one or none, which another rule reports.
pub(crate) fn connecting_roads<'a>(map: &RoadMap<'a>) -> HashSet<&'a str> {
    let connections = map.connections();
    let connections =
        connections.filter(|(junction, _)| junction.kind() == Some(JunctionType::Virtual));
    connections
        .filter_map(|(_, connection)| connection.connecting_road())
        .collect()
}

/// Checks whether a road may be linked to a position inside another road. This holds if it belongs
/// to a virtual junction, or to a junction of unknown type.
pub(crate) fn may_be_within(map: &RoadMap<'_>, road: &Road<'_>) -> bool {
    let Some(id) = road.junction() else {
        return false;
    };
    let kind = map.junction(id).map(|junction| junction.kind());
    !matches!(kind, Some(Some(kind)) if kind != JunctionType::Virtual)
}
