//! Numbering of the lanes of a section.

use crate::prelude::*;

/// Returns the lanes of a side whose number has the sign of the side, from the center outwards.
/// Separate rules check lanes with another number or without one.
pub(crate) fn outward<'m, 'a>(
    section: SectionRef<'m, 'a>,
    side: Side,
) -> Vec<(u64, LaneRef<'m, 'a>)> {
    let numbered = section.side(side).filter_map(|lane| {
        let id = lane.id()?;
        (Side::of_lane_id(id) == Some(side)).then_some((id.unsigned_abs(), lane))
    });
    let mut lanes: Vec<(u64, LaneRef<'m, 'a>)> = numbered.collect();
    lanes.sort_by_key(|(distance, _)| *distance);
    lanes
}

/// Returns the number of the lane at a distance from the center, as text.
pub(crate) fn number(side: Side, distance: u64) -> String {
    match side {
        Side::Left => distance.to_string(),
        Side::Right => format!("-{distance}"),
    }
}

/// Returns `left` or `right`.
pub(crate) fn word(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Right => "right",
    }
}
