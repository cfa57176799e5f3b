use crate::families::lane_ranges;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[RIGHT, LEFT, REFERENCE],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

const RIGHT: &str = "asam.net:xodr:1.7.0:road.object.validty.right_hand_traffic_lane_ids";
const LEFT: &str = "asam.net:xodr:1.7.0:road.object.validty.left_hand_traffic_lane_ids";
const REFERENCE: &str = "asam.net:xodr:1.7.0:road.object.validty.check_parent_orientation";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    const BOTH: [TrafficRule; 2] = [TrafficRule::RightHand, TrafficRule::LeftHand];
    lane_ranges::fit_orientation(map, &["object"], &BOTH[..1], Some(RIGHT), found);
    lane_ranges::fit_orientation(map, &["object"], &BOTH[1..], Some(LEFT), found);
    lane_ranges::fit_orientation(map, &["objectReference"], &BOTH, Some(REFERENCE), found);
}
