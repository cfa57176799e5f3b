//! Lanes for rail-bound vehicles (OpenDRIVE 1.9, 15.2).

use crate::prelude::*;

/// Returns the lanes of type `tram` and `rail`, with their type.
pub(crate) fn rail_lanes<'m, 'a>(
    map: &'m RoadMap<'a>,
) -> impl Iterator<Item = (LaneRef<'m, 'a>, &'a str)> {
    let rails = |lane: LaneRef<'m, 'a>| {
        let kind = lane
            .kind()
            .filter(|kind| matches!(*kind, "tram" | "rail"))?;
        Some((lane, kind))
    };
    map.lanes().filter_map(rails)
}
