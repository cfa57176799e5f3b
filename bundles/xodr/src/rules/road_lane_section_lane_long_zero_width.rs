use std::collections::BTreeMap;

use crate::families::on_road::{OnRoad, lane_name};
use crate::families::zero_stretches::zero_stretches;
use crate::prelude::*;

const LENGTH: Param = Param::number(
    "length",
    20.0,
    "m",
    "longest distance over which a lane without width is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    params: &[LENGTH],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(layer) = road.permanent() else {
            continue;
        };
        for side in Side::BOTH {
            // Lanes without width up to the end of the previous section: the s of the start, and
            // the lane there.
            let mut open: BTreeMap<i64, (f64, LaneRef<'_, '_>)> = BTreeMap::new();
            for section in layer.in_order(road).filter(|section| section.covers(side)) {
                open = walk(section, side, &open, found);
            }
        }
    }
}

type Open<'m, 'a> = BTreeMap<i64, (f64, LaneRef<'m, 'a>)>;

/// Checks the lanes of one section. Returns those without width at its end.
fn walk<'m, 'a>(
    section: SectionRef<'m, 'a>,
    side: Side,
    before: &Open<'m, 'a>,
    found: &mut Sink<'_>,
) -> Open<'m, 'a> {
    let mut open = BTreeMap::new();
    let (Some(start), Some(length)) = (section.s(), section.length(side)) else {
        return open;
    };
    for lane in section.side(side) {
        let (Some(id), Some(zero)) = (lane.id(), zero_stretches(lane)) else {
            continue;
        };
        for (from, to) in zero {
            let earlier = before.get(&id).filter(|_| from <= 1e-6);
            let (since, first) = earlier.copied().unwrap_or((start + from, lane));
            let goes_on =
                to >= length - 1e-6 && section.next(side).is_some_and(|next| starts_zero(next, id));
            if goes_on {
                open.insert(id, (since, first));
            } else {
                report(first, since, start + to, found);
            }
        }
    }
    open
}

fn starts_zero(section: SectionRef<'_, '_>, id: i64) -> bool {
    let zero = section.lane(id).and_then(zero_stretches);
    zero.is_some_and(|zero| zero.first().is_some_and(|(from, _)| *from <= 1e-6))
}

fn report(lane: LaneRef<'_, '_>, from: f64, to: f64, found: &mut Sink<'_>) {
    let limit = found.number(&LENGTH);
    if to - from > limit {
        let text = format!(
            "{} has no width over {:.2} m, from s = {from:.2} to s = {to:.2}; a length of more than {limit} m \
             without width should be avoided",
            lane_name(lane),
            to - from
        );
        let ds = from - lane.at.s().unwrap_or(0.0);
        found.issue(lane.node(), text).in_lane(lane, ds);
    }
}
