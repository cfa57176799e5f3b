use crate::families::on_road::{OnRoad, lane_name};
use crate::families::shown::beside;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.001,
    "m",
    "largest amount below zero at which a width counts as a rounding error",
);

const SMALL: Param = Param::number(
    "small",
    0.01,
    "m",
    "largest amount below zero at which a width counts as an effect of a fitted curve, which is a warning",
);

const NOTHING: Param = Param::number(
    "nothing",
    1e-6,
    "m",
    "largest amount below zero at which a width counts as zero, because coefficients have a limited number of \
     digits",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[NOTHING, TOLERANCE, SMALL],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        let Some(length) = lane.length() else {
            continue;
        };
        for stretch in lane.widths().stretches(length) {
            check(lane, &stretch, found);
        }
    }
}

fn check(lane: LaneRef<'_, '_>, stretch: &Stretch<'_, '_>, found: &mut Sink<'_>) {
    let Some(lowest) = stretch.cubic.minimum(0.0, stretch.length()) else {
        return;
    };
    if lowest.value >= -found.number(&NOTHING) {
        return;
    }
    let ds = stretch.from + lowest.at;
    let s = lane.at.s().unwrap_or(0.0) + ds;
    let text = format!(
        "the width of {} falls to {} m at s = {s:.3}; it must not be negative",
        lane_name(lane),
        beside(lowest.value, 0.0)
    );
    let level = match -lowest.value {
        below if below <= found.number(&TOLERANCE) => Level::Information,
        below if below <= found.number(&SMALL) => Level::Warning,
        _ => Level::Error,
    };
    found
        .issue(stretch.record.node(), text)
        .level(level)
        .in_lane(lane, ds);
}
