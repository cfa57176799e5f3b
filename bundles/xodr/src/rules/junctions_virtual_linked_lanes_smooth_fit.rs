use std::f64::consts::PI;

use crate::families::driving::is_drivable;
use crate::families::gap_levels::{
    GAP_BROKEN_FROM, GAP_ERROR_FROM, KINK_ERROR_FROM, Misfit, STEP_BROKEN_FROM, STEP_ERROR_FROM,
};
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::touching::{GAP, KINK, STEP};
use crate::families::virtual_junctions::{Branch, all_branches};
use crate::prelude::*;
use qcbus_opendrive::BorderPoint;
use qcbus_opendrive::LaneLink;

pub const RULE: Rule<Roads> = Rule {
    // The text about virtual junctions contains this requirement since 1.6. Its UID is from 1.9.
    versions: "1.6.0..",
    params: &[
        GAP,
        KINK,
        STEP,
        GAP_ERROR_FROM,
        GAP_BROKEN_FROM,
        KINK_ERROR_FROM,
        STEP_ERROR_FROM,
        STEP_BROKEN_FROM,
    ],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for branch in all_branches(map) {
        let section = branch.road.permanent().and_then(|layer| {
            let side = Side::Right;
            layer.end_section(branch.road, side, branch.end)
        });
        let Some(section) = section else { continue };
        for lane in section.lanes() {
            for link in lane.links(branch.end) {
                check(&branch, lane, link, found);
            }
        }
    }
}

fn check(branch: &Branch<'_, '_>, lane: LaneRef<'_, '_>, link: LaneLink<'_>, found: &mut Sink<'_>) {
    let Some(main) = link.id().and_then(|id| main_lane(branch, id)) else {
        return;
    };
    let Some(start) = main
        .at
        .s()
        .filter(|_| is_drivable(lane) && is_drivable(main))
    else {
        return;
    };
    let ds = branch.s - start;
    let borders = |edge| main.border(edge, ds);
    let (Some(own), Some(inner), Some(outer)) = (
        lane.borders_at(branch.end),
        borders(Edge::Inner),
        borders(Edge::Outer),
    ) else {
        return;
    };
    // Positions decide which edges meet, not their names. The lanes may run in opposite directions
    // and lie on either side of the center.
    let apart = |[one, other]: [BorderPoint; 2]| {
        let distance = |a: BorderPoint, b: BorderPoint| a.point.plan().distance(b.point.plan());
        distance(own[0], one).max(distance(own[1], other))
    };
    let there = if apart([inner, outer]) <= apart([outer, inner]) {
        [inner, outer]
    } else {
        [outer, inner]
    };
    let faults = faults(own, there, found);
    let Some((_, misfit)) = faults.iter().max_by_key(|(_, misfit)| *misfit) else {
        return;
    };
    let misfit = *misfit;
    let faults: Vec<&str> = faults.iter().map(|(text, _)| text.as_str()).collect();
    let text = format!(
        "{} is linked to {} at s = {}, but {}",
        lane_name(lane),
        lane_name(main),
        branch.s,
        faults.join(" and ")
    );
    misfit
        .put(found.issue(link.node(), text))
        .at_lane_end(lane, branch.end)
        .at(main.node(), "the lane of the main road")
        .in_lane(main, ds);
}

fn main_lane<'m, 'a>(branch: &Branch<'m, 'a>, id: i64) -> Option<LaneRef<'m, 'a>> {
    let layer = branch.main.permanent()?;
    layer
        .section_at(branch.main, Side::of_lane_id(id)?, branch.s)?
        .lane(id)
}

fn faults(
    own: [BorderPoint; 2],
    there: [BorderPoint; 2],
    found: &Sink<'_>,
) -> Vec<(String, Misfit)> {
    let [gap, kink, step] = [GAP, KINK, STEP].map(|param| found.number(&param));
    let mut worst = [0.0_f64; 3];
    for (one, other) in own.into_iter().zip(there) {
        let turn = one
            .hdg
            .zip(other.hdg)
            .and_then(|(a, b)| heading_difference(a, b));
        // A connecting road may run against the main road.
        let turn = turn.map_or(0.0, |turn| turn.min(PI - turn));
        let apart = one.point.plan().distance(other.point.plan());
        let met = [
            apart,
            if apart <= gap { turn } else { 0.0 },
            (one.point.z - other.point.z).abs(),
        ];
        for (most, this) in worst.iter_mut().zip(met) {
            *most = most.max(this);
        }
    }
    let [apart, turn, high] = worst;
    let mut faults = Vec::new();
    if apart > gap {
        let text = format!("their edges lie {apart:.3} m apart (at most {gap} m is allowed)");
        faults.push((text, Misfit::gap(apart, apart, found)));
    }
    if turn > kink {
        let text = format!(
            "their edges differ by {turn:.4} rad in heading (at most {kink} rad is allowed)"
        );
        faults.push((text, Misfit::kink(turn, found)));
    }
    if high > step {
        let text =
            format!("their edges differ by {high:.3} m in height (at most {step} m is allowed)");
        faults.push((text, Misfit::step(high, found)));
    }
    faults
}
