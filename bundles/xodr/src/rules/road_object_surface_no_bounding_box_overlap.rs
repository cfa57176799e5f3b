use std::collections::BTreeSet;

use crate::families::on_road::OnRoad;
use crate::families::polygons::sides;
use crate::families::strips::{area, common};
use crate::families::surface_boxes::{SurfaceBox, surface_boxes};
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.01,
    "m",
    "largest distance by which one box may extend into the other",
);

/// Maximum number of compared pairs of boxes.
const BUDGET: usize = 5_000_000;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let boxes = surface_boxes(map);
    let mut order: Vec<(usize, [f64; 2])> =
        boxes.iter().map(SurfaceBox::extent).enumerate().collect();
    order.sort_by(|one, other| one.1[0].total_cmp(&other.1[0]));
    let (mut budget, mut told) = (BUDGET, BTreeSet::new());
    for (rank, (at, extent)) in order.iter().enumerate() {
        let beside = order[rank + 1..].iter();
        for (next, _) in beside.take_while(|(_, other)| other[0] <= extent[1]) {
            budget = budget.saturating_sub(1);
            if budget == 0 {
                return;
            }
            // The pair is in file order, independent of the position.
            let (one, other) = (&boxes[*at.min(next)], &boxes[*at.max(next)]);
            if meet(one, other, found.number(&TOLERANCE))
                && told.insert((one.object.node(), other.object.node()))
            {
                report(one, other, found);
            }
        }
    }
}

/// Checks whether two boxes overlap by more than a tolerance.
fn meet(one: &SurfaceBox<'_, '_>, other: &SurfaceBox<'_, '_>, tolerance: f64) -> bool {
    let level = one.heights[0] <= other.heights[1] && other.heights[0] <= one.heights[1];
    if !level {
        return false;
    }
    let Some(shape) = common(&one.corners, &other.corners) else {
        return false;
    };
    // A narrow overlap may be long. Its width is compared, which is at least area over length.
    let around: f64 = sides(&shape).map(|(a, b)| a.distance(b)).sum();
    area(&shape) > tolerance * 0.5 * around
}

fn report(one: &SurfaceBox<'_, '_>, other: &SurfaceBox<'_, '_>, found: &mut Sink<'_>) {
    let id = |of: &SurfaceBox<'_, '_>| of.object.id().unwrap_or_default().to_owned();
    let text = if one.object.node() == other.object.node() {
        format!(
            "copies of object `{}` around s = {:.2} overlap each other; bounding volumes of objects with a surface \
             must not overlap",
            id(one),
            other.s
        )
    } else {
        format!(
            "objects `{}` and `{}` both have a surface, and their bounding volumes overlap; bounding volumes of \
             objects with a surface must not overlap",
            id(one),
            id(other)
        )
    };
    let finding = found
        .issue(other.object.node(), text)
        .on(other.road, other.s, other.t);
    if one.object.node() != other.object.node() {
        finding.at(one.object.node(), "the other object");
    }
}
