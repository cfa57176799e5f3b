use crate::families::lane_ranges;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_signal_reference_right_hand_traffic_lane_ids",
    uids: &["asam.net:xodr:1.7.0:road.signal.reference.right_hand_traffic_lane_ids"],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_signal_reference_right_hand_traffic_lane_ids.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    lane_ranges::fit_orientation(
        map,
        &["signalReference"],
        &[TrafficRule::RightHand],
        None,
        found,
    );
}
