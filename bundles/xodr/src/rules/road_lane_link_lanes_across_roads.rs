use std::collections::BTreeSet;

use crate::families::driving::is_drivable;
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

const NEAR: Param = Param::number(
    "near",
    0.1,
    "m",
    "largest distance between the edges of two lanes at which one lane continues as the other",
);

/// Minimum width of lanes that count as continuing, in metres.
const NARROW: f64 = 0.1;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[NEAR],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told = BTreeSet::new();
    for contact in map
        .road_contacts()
        .iter()
        .filter(|one| one.junction.is_none())
    {
        let (from, to) = (contact.from, contact.to);
        let roads = map.road_at(from.road).zip(map.road_at(to.road));
        let outside = |road: &Road<'_>| road.junction().is_none();
        let Some((one, other)) = roads.filter(|(one, other)| outside(one) && outside(other)) else {
            continue;
        };
        // An end with a link to itself has no continuation.
        if from != to && told.insert((from.min(to), from.max(to))) {
            let theirs: Vec<Open<'_, '_>> = open_lanes(other, to.end).collect();
            for lane in open_lanes(one, from.end) {
                check(&lane, from.end, &theirs, found);
            }
        }
    }
}

/// A lane without a link at an end of its road, with its inner and its outer edge there.
type Open<'m, 'a> = (LaneRef<'m, 'a>, [Point; 2]);

/// Returns the drivable lanes without a link at an end of a road.
fn open_lanes<'m, 'a>(road: &'m Road<'a>, end: ContactPoint) -> impl Iterator<Item = Open<'m, 'a>> {
    let sections = Side::BOTH.into_iter().filter_map(move |side| {
        let section = road.permanent()?.end_section(road, side, end)?;
        Some((section, side))
    });
    let lanes = sections.flat_map(|(section, side)| section.side(side));
    lanes
        .filter(move |lane| is_drivable(*lane) && lane.links(end).next().is_none())
        .filter_map(move |lane| {
            let edges = lane.borders_at(end)?.map(|border| border.point.plan());
            (edges[0].distance(edges[1]) >= NARROW).then_some((lane, edges))
        })
}

fn check(
    (lane, edges): &Open<'_, '_>,
    end: ContactPoint,
    theirs: &[Open<'_, '_>],
    found: &mut Sink<'_>,
) {
    let near = found.number(&NEAR);
    let goes_on = |(next, touching): &&Open<'_, '_>| {
        let mut pairs = edges.iter().zip(touching);
        next.kind() == lane.kind() && pairs.all(|(edge, touch)| edge.distance(*touch) <= near)
    };
    if let Some((next, _)) = theirs.iter().find(goes_on) {
        let text = format!(
            "{} continues as {}, but neither lane links to the other; lanes that continue should be linked in \
             both directions",
            lane_name(*lane),
            lane_name(*next)
        );
        found
            .issue(lane.node(), text)
            .at_lane_end(*lane, end)
            .at(next.node(), "the lane that continues it");
    }
}
