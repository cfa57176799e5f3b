use std::collections::BTreeMap;

use crate::families::driving::is_drivable;
use crate::families::gap_levels::GAP_BROKEN_FROM;
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::is_route;
use crate::families::shown::number;
use crate::prelude::*;
use qcbus_opendrive::LaneSpan;

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest step of a lane's edge within its lane section that is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[GAP, GAP_BROKEN_FROM],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            check(section, side, found);
        }
    }
}

fn check(section: SectionRef<'_, '_>, side: Side, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    let Some((start, length)) = section.s().zip(section.length(side)) else {
        return;
    };
    let lanes = section.side(side).map(|lane| lane.lane());
    let profiles = lanes.flat_map(|lane| [(lane.widths(), 0.0), (lane.borders(), 0.0)]);
    // First record with a step at each place, in nanometres from the start of the section.
    let mut steps: BTreeMap<i64, (f64, Node<'_>)> = BTreeMap::new();
    for (profile, from) in std::iter::once((section.layer.offset(), start)).chain(profiles) {
        for (x, node) in stepping(profile, limit) {
            let ds = x - from;
            if ds > 1e-6 && ds < length - 1e-6 {
                steps.entry((ds * 1e9) as i64).or_insert((ds, node));
            }
        }
    }
    for (ds, node) in steps.into_values() {
        let [before, after] =
            [Station::before(ds), Station::at(ds)].map(|at| section.spans(side, at));
        if let Some((lane, gap)) = jump(&before, &after, limit) {
            let whole = moved(&before, &after);
            report(lane, ds, (gap, whole), node, found);
        }
    }
}

/// Returns the records, except the first, at which a profile has a step, with their starts.
fn stepping<'p, 'a>(
    profile: &'p Profile<'a>,
    limit: f64,
) -> impl Iterator<Item = (f64, Node<'a>)> + use<'p, 'a> {
    profile.in_order().skip(1).filter_map(move |record| {
        let start = record.start()?;
        let step = profile.at(start)? - profile.at(Station::before(start))?;
        (step.abs() > limit).then_some((start, record.node()))
    })
}

/// Returns the first drivable lane with a jumping edge, and the size of the jump.
fn jump<'m, 'a>(
    before: &[LaneSpan<'m, 'a>],
    after: &[LaneSpan<'m, 'a>],
    limit: f64,
) -> Option<(LaneRef<'m, 'a>, f64)> {
    let pairs = before.iter().zip(after);
    let mut drivable = pairs.filter(|(one, _)| is_drivable(one.lane));
    drivable.find_map(|(one, next)| {
        let [inner, outer] = [next.inner - one.inner, next.outer - one.outer];
        let gap = if outer.abs() > inner.abs() {
            outer
        } else {
            inner
        };
        (gap.abs() > limit).then_some((one.lane, gap))
    })
}

/// Returns the sideways jump of a lane for traffic: the amount by which both edges jump to the same
/// side. A lane that only widens suddenly can be driven on.
fn moved(before: &[LaneSpan<'_, '_>], after: &[LaneSpan<'_, '_>]) -> f64 {
    let pairs = before.iter().zip(after);
    let travelled = pairs.filter(|(one, _)| is_route(one.lane));
    let moves = travelled.map(|(one, next)| {
        let [inner, outer] = [next.inner - one.inner, next.outer - one.outer];
        if inner * outer > 0.0 {
            inner.abs().min(outer.abs())
        } else {
            0.0
        }
    });
    moves.fold(0.0, f64::max)
}

fn report(
    lane: LaneRef<'_, '_>,
    ds: f64,
    (gap, whole): (f64, f64),
    node: Node<'_>,
    found: &mut Sink<'_>,
) {
    let s = lane.at.s().unwrap_or(0.0) + ds;
    let text = format!(
        "an edge of {} jumps sideways by {:.3} m at s = {}, where this `{}` begins; drivable lanes should have \
         no gaps within a lane section (at most {} m is accepted)",
        lane_name(lane),
        gap.abs(),
        number(s),
        node.name(),
        found.number(&GAP)
    );
    // Sudden widening is odd. Lanes that continue elsewhere are broken in every version.
    let level = match whole >= found.number(&GAP_BROKEN_FROM) {
        true => Level::Error,
        false => Level::Warning,
    };
    found
        .issue(node, text)
        .level(level)
        .in_lane(lane, ds)
        .at(lane.node(), "the lane");
}
