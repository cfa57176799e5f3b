use crate::families::lane_ranges;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
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
