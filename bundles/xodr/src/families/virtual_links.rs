//! Links of roads in virtual junctions.

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

/// Whether a road may be linked to a place within another: it belongs to a virtual junction, or to
/// one of which the file does not say what it is.
pub(crate) fn may_be_within(map: &RoadMap<'_>, road: &Road<'_>) -> bool {
    let Some(id) = road.junction() else {
        return false;
    };
    let kind = map.junction(id).map(|junction| junction.kind());
    !matches!(kind, Some(Some(kind)) if kind != JunctionType::Virtual)
}
