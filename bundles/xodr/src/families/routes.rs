//! Lanes that routes lead along, and where they enter and leave roads and junctions.

use qcbus_opendrive::{ContactPoint, LaneRef, Road, Side};
use qcbus_sdk::Param;

/// Narrower lanes lead nobody anywhere.
pub(crate) const NARROW: Param = Param::number(
    "narrow",
    1.0,
    "m",
    "a lane that is narrower than this is taken to begin or end there",
);

/// Whether a lane is there for vehicles to get along. Narrower than what vehicles may drive on: nobody plans a
/// route along a border.
pub(crate) fn is_route(lane: LaneRef<'_, '_>) -> bool {
    matches!(
        lane.kind(),
        Some(
            "driving"
                | "entry"
                | "exit"
                | "onRamp"
                | "offRamp"
                | "connectingRamp"
                | "slipLane"
                | "HOV"
                | "bidirectional"
                | "bus"
                | "taxi"
                | "mwyEntry"
                | "mwyExit"
                | "roadWorks"
        )
    )
}

/// The lanes at an end of a road, those of the permanent layer.
pub(crate) fn lanes_at<'m, 'a>(
    road: &'m Road<'a>,
    end: ContactPoint,
) -> impl Iterator<Item = LaneRef<'m, 'a>> {
    let sections = Side::BOTH.into_iter().filter_map(move |side| {
        let section = road.permanent()?.end_section(road, side, end)?;
        Some(section.side(side))
    });
    sections.flatten()
}

/// The lanes at an end of a road along which routes lead: those of some width.
pub(crate) fn routes_at<'m, 'a>(
    road: &'m Road<'a>,
    end: ContactPoint,
    narrow: f64,
) -> impl Iterator<Item = LaneRef<'m, 'a>> {
    lanes_at(road, end)
        .filter(|lane| is_route(*lane))
        .filter(move |lane| is_wide(*lane, end, narrow))
}

/// Whether a lane is that wide at an end of its section.
pub(crate) fn is_wide(lane: LaneRef<'_, '_>, end: ContactPoint, narrow: f64) -> bool {
    lane.width_at(end).is_some_and(|it| it >= narrow)
}
