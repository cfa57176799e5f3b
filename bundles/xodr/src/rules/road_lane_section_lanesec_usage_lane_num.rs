use crate::families::on_road::{OnRoad, lane_name};
use crate::families::zero_stretches::zero_stretches;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        let Some((zero, length)) = zero_stretches(lane).zip(lane.length()) else {
            continue;
        };
        for (from, to) in zero {
            // The lane opens or closes within the section.
            let place = if to < length - 1e-3 {
                Some((to, "opens"))
            } else if from > 1e-3 {
                Some((from, "closes"))
            } else {
                None
            };
            let Some((ds, what)) = place else { continue };
            let s = lane.at.s().unwrap_or(0.0) + ds;
            let text = format!(
                "{} {what} at s = {s:.2} within its lane section; a new lane section must be defined where the \
                 number of lanes changes",
                lane_name(lane)
            );
            found.issue(lane.node(), text).in_lane(lane, ds);
        }
    }
}
