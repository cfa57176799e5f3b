use crate::families::direct_overlap::{DEFAULT_ZONE, SharedSpace, shared_spaces, zone};
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.1,
    "m",
    "maximum length by which an overlap may exceed its zone",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for space in shared_spaces(map) {
        for at in 0..2 {
            check(&space, at, found);
        }
    }
}

fn check(space: &SharedSpace<'_, '_>, at: usize, found: &mut Sink<'_>) {
    let (arm, other, length) = (&space.arms[at], &space.arms[1 - at], space.lengths[at]);
    let stated = arm.link.attribute("overlapZone").is_some();
    let value = zone(arm.link);
    if stated && value.is_none()
        || length <= value.unwrap_or(DEFAULT_ZONE) + found.number(&TOLERANCE)
    {
        return;
    }
    let says = match value {
        Some(value) => format!("its `overlapZone` is {value} m"),
        None => format!("without `overlapZone` the zone is {DEFAULT_ZONE} m long"),
    };
    let text = format!(
        "{} and {} share their space for {length:.1} m from the junction, but {says}; the zone must cover the \
         whole overlap",
        lane_name(arm.lane),
        lane_name(other.lane)
    );
    let end = arm.road().end_s(arm.end).unwrap_or(0.0);
    let s = if end > 0.0 { end - length } else { length };
    let last = space.places.iter().map(|place| place[at]);
    let t = last.min_by(|one, other| (one.0 - s).abs().total_cmp(&(other.0 - s).abs()));
    found
        .issue(Place::attribute_or_node(arm.link, "overlapZone"), text)
        .on(arm.road(), s, t.map_or(0.0, |(_, t)| t))
        .at(other.link, "the link to the other lane");
}
