use crate::families::on_road::{OnRoad, lane_name};
use crate::families::zero_stretches::NO_WIDTH;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        for end in ContactPoint::BOTH {
            if lane.links(end).nth(1).is_some() {
                check(map, lane, end, found);
            }
        }
    }
}

fn check<'a>(map: &RoadMap<'a>, lane: LaneRef<'_, 'a>, end: ContactPoint, found: &mut Sink<'_>) {
    if lane.width_at(end).is_some_and(|width| width <= NO_WIDTH) {
        let text = format!(
            "{} has several `{}` links, but no width at its {end}; lanes that split or merge must have width \
             there",
            lane_name(lane),
            end.link_name()
        );
        found.issue(lane.node(), text).at_lane_end(lane, end);
    }
    for link in lane.links(end) {
        let linked = link
            .id()
            .and_then(|id| map.linked_lane(lane, end, id, link.layer()));
        let Some((there, at)) = linked.and_then(|at| Some((map.lane(at.lane)?, at.end))) else {
            continue;
        };
        if there.width_at(at).is_some_and(|width| width <= NO_WIDTH) {
            let text = format!(
                "{} is one of several `{}` lanes of {}, but has no width where they meet; lanes that split or \
                 merge must have width there",
                lane_name(there),
                end.link_name(),
                lane_name(lane)
            );
            found
                .issue(link.node(), text)
                .at_lane_end(lane, end)
                .at(there.node(), "the linked lane");
        }
    }
}
