//! Functions for plane polygons.

use crate::prelude::*;

/// Returns the distance of a point from the line between two others, in metres.
pub(crate) fn distance_to_line(point: Point, one: Point, other: Point) -> f64 {
    let (dx, dy) = (other.x - one.x, other.y - one.y);
    let squared = dx * dx + dy * dy;
    let share = if squared > 0.0 {
        (((point.x - one.x) * dx + (point.y - one.y) * dy) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let foot = Point {
        x: one.x + share * dx,
        y: one.y + share * dy,
    };
    point.distance(foot)
}

/// Returns the sides of a polygon. The last side joins the last point to the first.
pub(crate) fn sides(polygon: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().copied().zip(next.copied())
}

/// Returns the distance of a point from the boundary of a polygon, in metres.
pub(crate) fn distance_to_boundary(point: Point, polygon: &[Point]) -> f64 {
    sides(polygon)
        .map(|(one, other)| distance_to_line(point, one, other))
        .fold(f64::INFINITY, f64::min)
}

/// Checks whether a point lies inside a polygon, by the number of sides that a ray crosses.
pub(crate) fn contains(polygon: &[Point], point: Point) -> bool {
    let crosses = |one: Point, other: Point| {
        (one.y > point.y) != (other.y > point.y)
            && point.x < one.x + (point.y - one.y) / (other.y - one.y) * (other.x - one.x)
    };
    sides(polygon)
        .filter(|(one, other)| crosses(*one, *other))
        .count()
        % 2
        == 1
}
