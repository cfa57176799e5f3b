use crate::families::faults::shape_of;
use std::f64::consts::TAU;

use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::is_route;
use crate::prelude::*;
use qcbus_opendrive::geometry::Curve;

const BACKWARDS: Param = Param::number(
    "backwards",
    0.5,
    "m",
    "largest distance over which the edge of a lane may run backwards",
);
const RADIUS: Param = Param::number(
    "radius",
    1.0,
    "m",
    "a curve with a smaller radius must not make more than one full turn",
);

/// Radius in metres above which a curve has enough space for any lanes.
const WIDE: f64 = 60.0;
/// Number of places on a curve at which its edges are checked.
const PLACES: u32 = 8;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[BACKWARDS, RADIUS],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            let Some(length) = geometry.length().filter(|length| *length > 0.0) else {
                continue;
            };
            let Some(curve) = geometry.curve() else {
                continue;
            };
            if sharpest(&curve, length) * WIDE > 1.0
                && !winds(geometry, &curve, length, road, found)
            {
                folds(geometry, length, road, found);
            }
        }
    }
}

/// Returns the largest curvature of a shape. Polynomials are sampled at some places.
fn sharpest(curve: &Curve, length: f64) -> f64 {
    let greatest = |curvatures: [Option<f64>; 5]| {
        let known = curvatures.into_iter().flatten().map(f64::abs);
        known.fold(0.0, f64::max)
    };
    const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
    match curve {
        Curve::Line => 0.0,
        Curve::Arc { curvature } => curvature.abs(),
        Curve::Spiral(spiral) => spiral.start.abs().max(spiral.curvature(length).abs()),
        Curve::ParamPoly3(curve) => {
            let last = curve.last_parameter(length);
            greatest(SHARES.map(|share| Some(curve.pose(share * last)?.curvature)))
        }
        Curve::Poly3(curve) => {
            greatest(SHARES.map(|share| Some(curve.pose(share * length)?.curvature)))
        }
    }
}

/// Reports and returns whether a curve turns around more than once within centimetres.
fn winds(
    geometry: &Geometry<'_>,
    curve: &Curve,
    length: f64,
    road: &Road<'_>,
    found: &mut Sink<'_>,
) -> bool {
    let (name, curvature) = match curve {
        Curve::Arc { curvature } => ("curvature", *curvature),
        Curve::Spiral(spiral) => {
            let (start, end) = (spiral.start, spiral.curvature(length));
            let name = if start.abs() > end.abs() {
                "curvStart"
            } else {
                "curvEnd"
            };
            (name, if start.abs() > end.abs() { start } else { end })
        }
        _ => return false,
    };
    let share = if matches!(curve, Curve::Spiral(_)) {
        0.5
    } else {
        1.0
    };
    let turns = share * curvature.abs() * length / TAU;
    let least = found.number(&RADIUS);
    if curvature.abs() * least <= 1.0 || turns <= 1.0 {
        return false;
    }
    let text = format!(
        "the curve of road `{}` has a radius of {:.4} m and makes {turns:.1} full turns; a curvature is 1 / \
         radius, and curves with a radius of less than {least} m must not make more than one full turn",
        road.id(),
        1.0 / curvature.abs()
    );
    let shape = geometry.shape_node().unwrap_or(geometry.node());
    let finding = found.issue(Place::attribute_or_node(shape, name), text);
    if let Some(s) = geometry.s() {
        finding.on(road, s, 0.0);
    }
    true
}

/// A lane edge that runs backwards.
struct Fold<'m, 'a> {
    lane: LaneRef<'m, 'a>,
    s: f64,
    t: f64,
    radius: f64,
}

/// Reports the lane with an outer edge beyond the center of the curve.
fn folds(geometry: &Geometry<'_>, length: f64, road: &Road<'_>, found: &mut Sink<'_>) {
    let (Some(start), Some(placed)) = (geometry.s(), geometry.placed()) else {
        return;
    };
    let mut backwards = 0.0;
    let mut worst: Option<Fold<'_, '_>> = None;
    let step = length / f64::from(PLACES);
    for place in 0..PLACES {
        let ds = (f64::from(place) + 0.5) * step;
        let Some(fold) = fold_at(road, &placed, start, ds) else {
            continue;
        };
        let beyond = fold.t.abs() - fold.radius;
        backwards += step * beyond / fold.radius;
        if worst
            .as_ref()
            .is_none_or(|worst| beyond > worst.t.abs() - worst.radius)
        {
            worst = Some(fold);
        }
    }
    let most = found.number(&BACKWARDS);
    let Some(fold) = worst.filter(|_| backwards > most) else {
        return;
    };
    let text = format!(
        "the curve has a radius of {:.2} m at s = {:.2}, but the outer edge of {} lies {:.2} m to the inside and \
         runs {backwards:.2} m backwards; lanes on the inside of a curve must fit within its radius",
        fold.radius,
        fold.s,
        lane_name(fold.lane),
        fold.t.abs(),
    );
    let shape = geometry.shape_node().unwrap_or(geometry.node());
    found
        .issue(shape, text)
        .on(road, fold.s, fold.t)
        .at(fold.lane.node(), "the lane")
        .follows(shape_of(road));
}

/// Returns the outermost inner lane for vehicles if it extends beyond the center of the curve.
fn fold_at<'m, 'a>(
    road: &'m Road<'a>,
    placed: &Placed,
    start: f64,
    ds: f64,
) -> Option<Fold<'m, 'a>> {
    let curvature = match placed.curve {
        // For these shapes the curvature is computed directly, because their points are expensive.
        Curve::Arc { curvature } => curvature,
        Curve::Spiral(spiral) => spiral.curvature(ds),
        _ => placed.pose(ds)?.curvature,
    };
    let radius = 1.0 / curvature.abs();
    if radius.is_nan() || radius > WIDE {
        return None;
    }
    let side = if curvature > 0.0 {
        Side::Left
    } else {
        Side::Right
    };
    let s = start + ds;
    let section = road.permanent()?.section_at(road, side, s)?;
    let station = s - section.s()?;
    let outermost = section.each_span(side, station).filter(|span| {
        let width = (span.outer - span.inner).abs();
        width > 0.1 && is_route(span.lane)
    });
    let span = outermost.last()?;
    let t = span.outer;
    let is_beyond = t * side.sign() > radius;
    let is_there = is_beyond && placed.pose(ds).is_some();
    is_there.then_some(Fold {
        lane: span.lane,
        s,
        t,
        radius,
    })
}
