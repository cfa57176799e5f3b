use crate::families::cross_paths::{Crossing, Landing, crossings};
use crate::families::on_road::OnRoad;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "maximum distance of an end of a crossing road beside the linked lane",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for crossing in crossings(map) {
        for landing in crossing.landings(map) {
            if !is_nowhere(&crossing, &landing, found) {
                check(&crossing, &landing, found);
            }
        }
    }
}

/// Reports a link to a position or a lane that the road does not have.
fn is_nowhere(
    crossing: &Crossing<'_, '_>,
    landing: &Landing<'_, '_>,
    found: &mut Sink<'_>,
) -> bool {
    let (other, s) = (landing.other, landing.s);
    let Some(length) = other.length().filter(|length| *length > 0.0) else {
        return false;
    };
    let limit = found.number(&TOLERANCE);
    let node = landing.link.node();
    let (place, text) = if s < -limit || s > length + limit {
        let text = format!(
            "the {} of crossing road `{}` is linked at s = {s} of road `{}`, which goes from s = 0 to s = {length}; it \
             must reach a lane of that road",
            landing.end,
            crossing.road.id(),
            other.id()
        );
        (Place::attribute_or_node(node, "s"), text)
    } else if !has_lane(other, s.clamp(0.0, length), landing.lane) {
        let text = format!(
            "the {} of crossing road `{}` is linked to lane `{}` of road `{}`, which has no such lane at s = \
             {s}; it must reach a lane of that road",
            landing.end,
            crossing.road.id(),
            landing.lane,
            other.id()
        );
        (Place::attribute_or_node(node, "from"), text)
    } else {
        return false;
    };
    found
        .issue(place, text)
        .at(crossing.road.node(), "the crossing road");
    true
}

/// Checks whether any layer of a road has the lane at s, on either side of a section boundary.
fn has_lane(road: &Road<'_>, s: f64, lane: i64) -> bool {
    // The center lane has no side and exists everywhere.
    let Some(side) = Side::of_lane_id(lane) else {
        return true;
    };
    let mut sections = road.layers().iter().flat_map(|layer| {
        let stations = [Station::at(s), Station::before(s)];
        stations.map(|station| layer.section_at(road, side, station))
    });
    sections.any(|section| section.is_some_and(|section| section.lane(lane).is_some()))
}

fn check(crossing: &Crossing<'_, '_>, landing: &Landing<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&TOLERANCE);
    let lane = landing.link.to();
    let middle = lane.and_then(|lane| crossing.middle(landing.end, lane));
    let Some((s, t)) = middle.and_then(|middle| landing.project(middle)) else {
        return;
    };
    let Some([low, high]) = landing.span(s) else {
        return;
    };
    let beside = (low - t).max(t - high);
    // The link names one position, but the crossing road covers its whole width.
    let half = crossing
        .corners(landing.end)
        .map_or(0.0, |[one, other]| 0.5 * one.distance(other));
    let along = (s - landing.s).abs() - half;
    let what = if beside > limit {
        format!(
            "{beside:.2} m beside lane `{}` of road `{}`",
            landing.lane,
            landing.other.id()
        )
    } else if along > 0.1 {
        format!(
            "at s = {s:.2} of road `{}`, but the link says s = {}",
            landing.other.id(),
            landing.s
        )
    } else {
        return;
    };
    let text = format!(
        "the {} of crossing road `{}` lies {what}; it must reach the linked lane",
        landing.end,
        crossing.road.id()
    );
    found
        .issue(landing.link.node(), text)
        .at_end(crossing.road, landing.end)
        .at(crossing.road.node(), "the crossing road");
}
