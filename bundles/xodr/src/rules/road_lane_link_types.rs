use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::{NARROW, is_route};
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[NARROW],
    run,
    ..Rule::after(READABLE)
};

/// Types of lanes on which no vehicle drives, independent of the lanes before and after them.
const FOR_OTHERS: &[&str] = &["sidewalk", "walking", "curb", "median", "rail", "tram"];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told = HashSet::default();
    for joint in map.lane_joints() {
        let lanes = map.lane(joint.from.lane).zip(map.lane(joint.to.lane));
        let Some((from, to)) = lanes.filter(|(from, to)| from.kind() != to.kind()) else {
            continue;
        };
        let clash = (is_route(from) && is_for_others(to)) || (is_route(to) && is_for_others(from));
        if !clash || !is_wide(joint, from, to, found.number(&NARROW)) {
            continue;
        }
        if !told.insert((joint.from.min(joint.to), joint.from.max(joint.to))) {
            continue;
        }
        let text = format!(
            "{}, a lane of type `{}`, continues as {}, which has type `{}`; a lane for vehicles should not \
             continue as a lane that is not for vehicles, or the reverse",
            lane_name(from),
            from.kind().unwrap_or_default(),
            lane_name(to),
            to.kind().unwrap_or_default()
        );
        found
            .issue(joint.node, text)
            .at_lane_end(from, joint.from.end)
            .at(to.node(), "the linked lane");
    }
}

fn is_for_others(lane: LaneRef<'_, '_>) -> bool {
    lane.kind().is_some_and(|kind| FOR_OTHERS.contains(&kind))
}

fn is_wide(joint: &LaneJoint<'_>, from: LaneRef<'_, '_>, to: LaneRef<'_, '_>, narrow: f64) -> bool {
    let widths = [from.width_at(joint.from.end), to.width_at(joint.to.end)];
    widths
        .into_iter()
        .all(|width| width.is_some_and(|it| it >= narrow))
}
