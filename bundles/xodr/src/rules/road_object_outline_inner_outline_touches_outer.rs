use crate::families::object_frame::ObjectFrame;
use crate::families::on_road::OnRoad;
use crate::families::polygons::{contains, distance_to_boundary};
use crate::prelude::*;
use qcbus_opendrive::Corner;

const TOUCH: Param = Param::number(
    "touch",
    0.01,
    "m",
    "largest distance between a corner and the other outline at which they touch",
);

/// Maximum distance in metres of corners that count as the same point.
const SAME: f64 = 0.001;

/// Maximum number of comparisons for one object. Only hostile files need more.
const MOST: usize = 5_000_000;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.5.0" },
    params: &[TOUCH],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for (road, object) in map.part(part).objects() {
        let (inner, outer): (Vec<_>, Vec<_>) = object
            .outlines()
            .partition(|outline| outline.outer() == Some(false));
        // With any other number of outer outlines, the intended one is unknown.
        let ([outer], Some(frame)) = (outer.as_slice(), ObjectFrame::of(road, &object)) else {
            continue;
        };
        let Some(shape) = polygon(&frame, outer).filter(|shape| shape.len() > 2) else {
            continue;
        };
        let corners = || inner.iter().flat_map(|outline| outline.corners());
        if shape.len().saturating_mul(corners().count()) <= MOST {
            for corner in corners() {
                check(road, &object, &frame, &corner, &shape, found);
            }
        }
    }
}

/// Returns the corners in u and v, or `None` for curves and for corners without a position.
fn polygon<'a>(frame: &ObjectFrame<'_, 'a>, outline: &Outline<'a>) -> Option<Vec<Point>> {
    let corners = outline.corners().map(|corner| place(frame, &corner));
    corners.collect()
}

fn place<'a>(frame: &ObjectFrame<'_, 'a>, corner: &Corner<'a>) -> Option<Point> {
    let [u, v, _] = frame
        .corner(corner)
        .filter(|_| corner.kind != CornerKind::Curve)?;
    Point::finite(u, v)
}

fn check<'a>(
    road: &Road<'a>,
    object: &Object<'a>,
    frame: &ObjectFrame<'_, 'a>,
    corner: &Corner<'a>,
    shape: &[Point],
    found: &mut Sink<'_>,
) {
    let Some(point) = place(frame, corner) else {
        return;
    };
    let distance = distance_to_boundary(point, shape);
    let touches = distance <= found.number(&TOUCH);
    let shared = shape.iter().any(|other| other.distance(point) <= SAME);
    let what = if touches && !shared {
        "touches the outer outline between its corners; both outlines must have a corner at the point where they \
         touch"
    } else if !touches && !contains(shape, point) {
        "lies outside of the outer outline; inner outlines must lie inside"
    } else {
        return;
    };
    let text = format!(
        "a corner of an inner outline of object `{}` at u = {:.3}, v = {:.3} {what}",
        object.id().unwrap_or_default(),
        point.x,
        point.y
    );
    found.issue(corner.point.node(), text).on(
        road,
        object.s().unwrap_or(0.0),
        object.t().unwrap_or(0.0),
    );
}
