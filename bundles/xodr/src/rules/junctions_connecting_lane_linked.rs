use crate::families::faults::OfFault as _;
use std::cell::LazyCell;

use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::{NARROW, is_route, is_wide, lanes_at, routes_at};
use crate::prelude::*;
use foldhash::HashSet;

const NEAR: Param = Param::number(
    "near",
    0.1,
    "m",
    "maximum distance between the edges of two lanes for one to continue as the other",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[NARROW, NEAR],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut seen = HashSet::default();
    // The set is computed lazily, because nearly all lanes have their own links.
    let taken = LazyCell::new(|| {
        let joints = map.junction_joints().iter();
        joints
            .flat_map(|joint| [joint.from, joint.to])
            .collect::<HashSet<LaneEnd>>()
    });
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Common) || connection.is_virtual() {
            continue;
        }
        let connecting = connection.connecting_road().and_then(|id| map.road(id));
        let Some(road) = connecting.filter(|road| seen.insert(road.index())) else {
            continue;
        };
        for end in ContactPoint::BOTH {
            if let Some(contact) = map.linked_end(road, end) {
                check(map, &taken, (road, end), contact.to, found);
            }
        }
    }
}

/// The lane ends in lane links of junctions.
type Taken<F> = LazyCell<HashSet<LaneEnd>, F>;

fn check(
    map: &RoadMap<'_>,
    taken: &Taken<impl FnOnce() -> HashSet<LaneEnd>>,
    (road, end): (&Road<'_>, ContactPoint),
    there: RoadEnd,
    found: &mut Sink<'_>,
) {
    let narrow = found.number(&NARROW);
    let open = |lane: &LaneRef<'_, '_>| {
        let at = LaneEnd::of(*lane, end);
        is_route(*lane) && is_wide(*lane, end, narrow) && !taken.contains(&at)
    };
    let ending = lanes_at(road, end).filter(|lane| lane.links(end).next().is_none());
    let mut open = ending.filter(open).peekable();
    let Some(other) = map.road_at(there.road).filter(|_| open.peek().is_some()) else {
        return;
    };
    let open: Vec<_> = open.collect();
    for lane in open {
        let near = found.number(&NEAR);
        let touches = |next: &LaneRef<'_, '_>| touch((lane, end), (*next, there.end), near);
        let Some(next) = routes_at(other, there.end, narrow).find(touches) else {
            continue;
        };
        let text = format!(
            "lane `{}` of the connecting road `{}` continues as {}, but has no {}, so routes end there; lanes of \
             connecting roads must be linked at both ends",
            lane.id_text().unwrap_or_default(),
            road.id(),
            lane_name(next),
            end.link_name()
        );
        // If only the end from which traffic comes is linked, the other link is missing by mistake.
        let begun = lane.links(end.other()).next().is_some();
        let forgotten = begun && Traffic::of(lane) == Traffic::Towards(end);
        let level = if forgotten {
            Level::Error
        } else {
            Level::Warning
        };
        let finding = found
            .issue(lane.node(), text)
            .level(level)
            .at_lane_end(lane, end)
            .at(next.node(), "the lane that continues it");
        if let Some(junction) = map.junction_of(road) {
            finding.of_junction(junction.node());
        }
    }
}

/// Checks whether both edges of two lanes meet.
fn touch(
    (lane, end): (LaneRef<'_, '_>, ContactPoint),
    (next, at): (LaneRef<'_, '_>, ContactPoint),
    near: f64,
) -> bool {
    let Some((one, other)) = lane.borders_at(end).zip(next.borders_at(at)) else {
        return false;
    };
    let mut pairs = one.iter().zip(&other);
    pairs.all(|(edge, touch)| edge.point.plan().distance(touch.point.plan()) <= near)
}
