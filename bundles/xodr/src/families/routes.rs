//! Lanes for routes, and their entries to and exits from roads and junctions.

use crate::prelude::*;

/// Minimum width of a lane for a route.
pub(crate) const NARROW: Param = Param::number(
    "narrow",
    1.0,
    "m",
    "width below which a lane counts as beginning or ending there",
);

/// Types of lanes with regular vehicle traffic in one direction.
pub(crate) const DIRECTED: [&str; 10] = [
    "driving",
    "entry",
    "exit",
    "onRamp",
    "offRamp",
    "connectingRamp",
    "slipLane",
    "bus",
    "taxi",
    "HOV",
];

/// Checks whether a lane is intended for through traffic of vehicles. This is stricter than being
/// drivable: routes do not use a border, for example.
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

/// Returns the lanes of the permanent layer at an end of a road.
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

/// Returns the lanes for routes at an end of a road that are wide enough.
pub(crate) fn routes_at<'m, 'a>(
    road: &'m Road<'a>,
    end: ContactPoint,
    narrow: f64,
) -> impl Iterator<Item = LaneRef<'m, 'a>> {
    lanes_at(road, end)
        .filter(|lane| is_route(*lane))
        .filter(move |lane| is_wide(*lane, end, narrow))
}

/// Checks whether a lane has at least this width at an end of its section.
pub(crate) fn is_wide(lane: LaneRef<'_, '_>, end: ContactPoint, narrow: f64) -> bool {
    lane.width_at(end).is_some_and(|it| it >= narrow)
}
