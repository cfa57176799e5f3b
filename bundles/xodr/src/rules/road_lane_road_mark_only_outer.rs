use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;
use qcbus_opendrive::LaneRecord;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes().filter(|lane| lane.side().is_some()) {
        for mark in lane.records_named("roadMark") {
            check(lane, &mark, found);
        }
    }
}

fn check(lane: LaneRef<'_, '_>, mark: &LaneRecord<'_>, found: &mut Sink<'_>) {
    let ds = mark.s_offset().unwrap_or(0.0);
    let Some(half) = widest(lane, ds)
        .map(|width| 0.5 * width)
        .filter(|half| *half > 0.0)
    else {
        return;
    };
    let kinds = mark
        .node()
        .children()
        .filter(|child| child.is("type") || child.is("explicit"));
    let lines = kinds.flat_map(|kind| kind.children().filter(|child| child.is("line")));
    let offsets: Option<Vec<f64>> = lines.map(|line| line.f64("tOffset").ok()).collect();
    let Some(offsets) = offsets else { return };
    // Lines on both sides of the border form one mark on the border.
    let either = |side: fn(&f64) -> bool| offsets.iter().any(side);
    if either(|t| *t <= 0.0) && either(|t| *t >= 0.0) {
        return;
    }
    let Some(nearest) = offsets.into_iter().map(f64::abs).reduce(f64::min) else {
        return;
    };
    if nearest > half {
        let text = format!(
            "every line of this road mark lies at least {nearest:.2} m away from the outer border of {}, which \
             is more than half of the lane's width of {:.2} m; a road mark describes the marking at the outer \
             border",
            lane_name(lane),
            2.0 * half
        );
        let s = lane.at.s().unwrap_or(0.0) + ds;
        let t = lane.outer_t(ds).unwrap_or(0.0);
        found.issue(mark.node(), text).on(lane.at.road, s, t);
    }
}

/// Returns the largest width from `ds` on. Where a lane opens, any line would lie beside it.
fn widest(lane: LaneRef<'_, '_>, ds: f64) -> Option<f64> {
    let length = lane.length()?;
    let stretches = lane.widths().stretches(length);
    let behind = stretches.filter(|stretch| stretch.from + stretch.length() > ds);
    let widest = behind.filter_map(|stretch| {
        let greatest = stretch.cubic.maximum(0.0, stretch.length())?;
        Some(greatest.value)
    });
    widest.reduce(f64::max).or_else(|| lane.width(ds))
}
