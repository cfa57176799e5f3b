//! How the lanes of a section are numbered.

use qcbus_opendrive::{LaneRef, SectionRef, Side};

/// The lanes of a side whose number has the side's sign, from the smallest distance to the
/// largest; lanes with another or no number have rules of their own.
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

/// The number of the lane at a distance from the center, as text.
pub(crate) fn number(side: Side, distance: u64) -> String {
    match side {
        Side::Left => distance.to_string(),
        Side::Right => format!("-{distance}"),
    }
}

/// `left` or `right`.
pub(crate) fn word(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Right => "right",
    }
}
