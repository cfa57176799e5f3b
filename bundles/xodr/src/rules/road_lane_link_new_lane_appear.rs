use crate::families::faults::OfFault as _;
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::zero_width::{ZERO_WIDTH, is_zero_at, opens};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.4.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[ZERO_WIDTH],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let zero = found.number(&ZERO_WIDTH);
    for joint in map.part(part).lane_joints() {
        let (Some(from), Some(to)) = (map.lane(joint.from.lane), map.lane(joint.to.lane)) else {
            continue;
        };
        if !is_zero_at(to, joint.to.end, zero) || !opens(to, zero) {
            continue;
        }
        let text = format!(
            "{} is linked to {}, whose width is zero where they meet; a lane that opens beside \
             another must not be linked to it",
            lane_name(from),
            lane_name(to)
        );
        found
            .issue(from.node(), text)
            .here("the lane that continues")
            .at(to.node(), "the lane that has no width here")
            .at_lane_end(to, joint.to.end)
            .at(joint.node, "the link")
            .at_opening(from, joint.from.end)
            .at_opening(to, joint.to.end);
    }
}
