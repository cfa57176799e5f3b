//! Points of the shapes of trajectories.

use qcbus_opendrive::geometry::Spiral;

use super::{MOST_POINTS, Spot};
use crate::places::Whereabouts;
use crate::queries::element::Element;

/// Points of a shape.
#[derive(Debug, Default)]
pub(super) struct Line {
    pub(super) points: Vec<Spot>,
    /// Number of positions whose place is unknown.
    pub(super) unplaced: usize,
    pub(super) is_thinned: bool,
    pub(super) is_exact: bool,
}

/// Distance of the points of a clothoid in metres.
const SPACING: f64 = 2.0;

/// Number of points of a curve between two control points.
const PER_SPAN: usize = 12;

/// Maximum order of a curve. Higher orders have no use and are slow.
const MOST_ORDER: usize = 20;

/// Returns the points of a `Shape`. `place` returns the place of a `Position`.
pub(super) fn line<'m, 'd, 'w, 'r>(
    shape: Element<'m, 'd>,
    place: &dyn Fn(Element<'m, 'd>) -> Option<Whereabouts<'w, 'r>>,
) -> Option<Line> {
    let kind = shape.children().next()?;
    Some(match kind.name() {
        "Polyline" => polyline(kind, "Vertex", place),
        "Clothoid" => clothoid(kind, place),
        "ClothoidSpline" => spline(kind, place),
        "Nurbs" => nurbs(kind, place),
        _ => return None,
    })
}

/// Leaves out points evenly if there are too many. Returns whether it did.
pub(super) fn thin(points: &mut Vec<Spot>) -> bool {
    let (step, last) = (points.len().div_ceil(MOST_POINTS), points.last().copied());
    if step <= 1 {
        return false;
    }
    let mut at = 0;
    points.retain(|_| {
        at += 1;
        (at - 1) % step == 0
    });
    points.extend(last);
    true
}

fn polyline<'m, 'd, 'w, 'r>(
    kind: Element<'m, 'd>,
    name: &'static str,
    place: &dyn Fn(Element<'m, 'd>) -> Option<Whereabouts<'w, 'r>>,
) -> Line {
    let count = kind.children_named(name).count();
    let step = count.div_ceil(MOST_POINTS).max(1);
    let mut line = Line {
        is_thinned: step > 1,
        is_exact: true,
        ..Line::default()
    };
    for (at, vertex) in kind.children_named(name).enumerate() {
        if at % step != 0 && at + 1 != count {
            continue;
        }
        match vertex.child("Position").and_then(place) {
            Some(it) => line.points.push([it.x, it.y]),
            None => {
                line.unplaced += 1;
                line.is_exact = false;
            }
        }
    }
    line
}

/// A point of a curve with its direction.
type Pose = ([f64; 2], f64);

fn clothoid<'m, 'd, 'w, 'r>(
    kind: Element<'m, 'd>,
    place: &dyn Fn(Element<'m, 'd>) -> Option<Whereabouts<'w, 'r>>,
) -> Line {
    let mut line = Line::default();
    let Some(start) = kind.child("Position").and_then(place) else {
        line.unplaced = 1;
        return line;
    };
    line.points.push([start.x, start.y]);
    let prime = kind
        .number("curvaturePrime")
        .or_else(|| kind.number("curvatureDot"));
    let values = (kind.number("curvature"), prime, kind.number("length"));
    if let (Some(curvature), Some(prime), Some(length)) = values {
        let end = curvature + prime * length;
        let from = ([start.x, start.y], start.heading);
        line.is_exact = arc(&mut line, from, [curvature, end], length).is_some();
    }
    line
}

fn spline<'m, 'd, 'w, 'r>(
    kind: Element<'m, 'd>,
    place: &dyn Fn(Element<'m, 'd>) -> Option<Whereabouts<'w, 'r>>,
) -> Line {
    let mut line = Line {
        is_exact: true,
        ..Line::default()
    };
    let mut here: Option<Pose> = None;
    for segment in kind.children_named("ClothoidSplineSegment") {
        if line.points.len() >= MOST_POINTS {
            line.is_thinned = true;
            break;
        }
        if let Some(position) = segment.child("PositionStart") {
            match place(position) {
                Some(it) => here = Some(([it.x, it.y], it.heading)),
                None => {
                    line.unplaced += 1;
                    here = None;
                }
            }
        }
        let bends = (
            segment.number("curvatureStart"),
            segment.number("curvatureEnd"),
        );
        let (Some((at, heading)), (Some(start), Some(end)), Some(length)) =
            (here, bends, segment.number("length"))
        else {
            line.is_exact = false;
            here = None;
            continue;
        };
        let turned = heading + segment.number("hOffset").unwrap_or(0.0);
        line.points.push(at);
        here = arc(&mut line, (at, turned), [start, end], length);
    }
    line
}

/// Adds the points of a clothoid. Returns its end.
fn arc(line: &mut Line, (at, heading): Pose, bends: [f64; 2], length: f64) -> Option<Pose> {
    let spiral = Spiral::between(bends[0], bends[1], length)?;
    let steps = (length / SPACING).ceil().clamp(8.0, 400.0);
    let (sin, cos) = heading.sin_cos();
    let mut end = None;
    for step in 1..=steps as usize {
        let pose = spiral.pose(length * step as f64 / steps)?;
        let point = [
            at[0] + pose.x * cos - pose.y * sin,
            at[1] + pose.x * sin + pose.y * cos,
        ];
        line.points.push(point);
        end = Some((point, heading + pose.hdg));
    }
    end
}

fn nurbs<'m, 'd, 'w, 'r>(
    kind: Element<'m, 'd>,
    place: &dyn Fn(Element<'m, 'd>) -> Option<Whereabouts<'w, 'r>>,
) -> Line {
    let control = polyline(kind, "ControlPoint", place);
    let points = kind.children_named("ControlPoint");
    let weights: Vec<f64> = points
        .map(|point| match point.has("weight") {
            true => point.number("weight").unwrap_or(1.0),
            false => 1.0,
        })
        .collect();
    let knots = kind.children_named("Knot").map(|knot| knot.number("value"));
    let curve = || {
        let knots = knots.take(2 * MOST_POINTS).collect::<Option<Vec<f64>>>()?;
        let order = usize::try_from(kind.integer("order")?).ok()?;
        let is_complete = control.is_exact && !control.is_thinned;
        is_complete.then(|| sampled(&control.points, &weights, &knots, order))?
    };
    match curve() {
        Some(points) => Line {
            points,
            is_exact: true,
            ..Line::default()
        },
        // The control points are near the curve.
        None => Line {
            is_exact: false,
            ..control
        },
    }
}

/// Returns points of a curve, or `None` if its numbers do not fit together.
fn sampled(points: &[Spot], weights: &[f64], knots: &[f64], order: usize) -> Option<Vec<Spot>> {
    let count = points.len();
    let is_sorted = knots.is_sorted_by(|one, other| one <= other);
    let fits = (2..=MOST_ORDER).contains(&order) && order <= count;
    if !fits || !is_sorted || knots.len() != count + order || weights.len() != count {
        return None;
    }
    let (from, to) = (*knots.get(order - 1)?, *knots.get(count)?);
    let steps = (PER_SPAN * (count + 1 - order)).clamp(24, MOST_POINTS - 1);
    let at = |step: usize| from + (to - from) * step as f64 / steps as f64;
    let all = (0..=steps).map(|step| de_boor(points, weights, knots, order, at(step)));
    all.collect()
}

/// Evaluates a curve at `u` by de Boor's algorithm in homogeneous coordinates.
fn de_boor(points: &[Spot], weights: &[f64], knots: &[f64], order: usize, u: f64) -> Option<Spot> {
    let degree = order - 1;
    let after = knots.partition_point(|knot| *knot <= u);
    let span = after.saturating_sub(1).clamp(degree, points.len() - 1);
    let first = span - degree;
    let homogeneous = |at: usize| {
        let ([x, y], weight) = (*points.get(at)?, *weights.get(at)?);
        Some([x * weight, y * weight, weight])
    };
    let mut row = (first..=span)
        .map(homogeneous)
        .collect::<Option<Vec<[f64; 3]>>>()?;
    for level in 1..=degree {
        for at in (level..=degree).rev() {
            let low = *knots.get(first + at)?;
            let high = *knots.get(span + 1 + at - level)?;
            let share = if high > low {
                (u - low) / (high - low)
            } else {
                0.0
            };
            let (one, other) = (*row.get(at - 1)?, *row.get(at)?);
            let mixed = std::array::from_fn(|axis| one[axis] + (other[axis] - one[axis]) * share);
            *row.get_mut(at)? = mixed;
        }
    }
    let [x, y, weight] = *row.get(degree)?;
    let point = [x / weight, y / weight];
    (point[0].is_finite() && point[1].is_finite()).then_some(point)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot continue panics")]

    use super::*;

    #[test]
    fn quarter_circle_is_a_curve_of_order_three() {
        let points = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let weights = [1.0, 0.5_f64.sqrt(), 1.0];
        let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let curve = sampled(&points, &weights, &knots, 3).unwrap();
        assert_eq!(
            (curve.first(), curve.last()),
            (Some(&points[0]), Some(&points[2]))
        );
        for [x, y] in curve {
            assert!((x.hypot(y) - 1.0).abs() < 1e-12, "{x} {y}");
        }
        assert_eq!(sampled(&points, &weights, &knots[1..], 3), None);
    }

    #[test]
    fn inner_knot_joins_two_straight_lines() {
        let points = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]];
        let knots = [0.0, 0.0, 0.5, 1.0, 1.0];
        let curve = sampled(&points, &[1.0; 3], &knots, 2).unwrap();
        assert!(curve.contains(&[10.0, 0.0]));
        assert!(
            curve
                .iter()
                .all(|[x, y]| *y == 0.0 || (*x - 10.0).abs() < 1e-9)
        );
    }

    #[test]
    fn long_line_keeps_its_ends() {
        let mut points: Vec<Spot> = (0..100_000).map(|at| [f64::from(at), 0.0]).collect();
        assert!(thin(&mut points));
        assert!(points.len() <= MOST_POINTS + 1);
        assert_eq!(
            (points[0], points[points.len() - 1]),
            ([0.0, 0.0], [99_999.0, 0.0])
        );
        assert!(!thin(&mut vec![[0.0, 0.0]; MOST_POINTS]));
    }

    #[test]
    fn clothoid_without_curvature_is_straight() {
        let mut line = Line::default();
        let end = arc(&mut line, ([1.0, 2.0], 0.0), [0.0, 0.0], 100.0).unwrap();
        assert!((end.0[0] - 101.0).abs() < 1e-9 && (end.0[1] - 2.0).abs() < 1e-9);
        assert!(arc(&mut line, ([0.0, 0.0], 0.0), [0.0, f64::NAN], 1.0).is_none());
    }
}
