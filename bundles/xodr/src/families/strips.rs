//! Strips of ground along roads, cut into quadrangles, and the common area of two quadrangles.

use super::driving::is_drivable;
use super::overlap::{cut, turn};
use crate::prelude::*;

/// Maximum number of quadrangles of one strip.
const MOST: f64 = 1024.0;

/// A quadrangle of a strip, between two cross sections of its road.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    /// s of the two cross sections in metres, in the direction of the strip.
    pub from: f64,
    pub to: f64,
    /// t of the right and the left edge at both cross sections.
    edges: [(f64, f64); 2],
    /// The corners, counter-clockwise.
    pub corners: [Point; 4],
}

/// t of the right and the left edge of a strip. `None` means that there is no strip.
type Edges = (f64, f64);

/// Returns the strip over `range` in steps of about `step` metres, backwards if the range is. Each
/// edge moves inward by `shrink`. Parts that are not convex quadrangles are left out.
pub(crate) fn strip(
    road: &Road<'_>,
    range: [f64; 2],
    step: f64,
    shrink: f64,
    edges: impl Fn(Station) -> Option<Edges>,
) -> Vec<Patch> {
    let [from, to] = range;
    let count = ((to - from).abs() / step).ceil().clamp(1.0, MOST);
    if !(to - from).is_finite() || from == to {
        return Vec::new();
    }
    let at = |index: f64| from + (to - from) * index / count;
    let cross = |station: Station| {
        let (right, left) = edges(station)?;
        let (right, left) = (right + shrink, left - shrink);
        let pose = road.pose(station)?;
        (left - right > 0.05).then_some(((right, left), pose.beside(right)?, pose.beside(left)?))
    };
    // If s descends, the section that ends at a station comes first.
    let sides = |s: f64| [Station::at(s), Station::before(s)];
    let (first, last) = if from < to { (0, 1) } else { (1, 0) };
    let patches = (0..count as usize).filter_map(|index| {
        let (begin, end) = (at(index as f64), at(index as f64 + 1.0));
        let start = cross(sides(begin)[first])?;
        let stop = cross(sides(end)[last])?;
        let (low, high) = if from < to {
            (start, stop)
        } else {
            (stop, start)
        };
        let corners = [low.1, high.1, high.2, low.2];
        let convex = (0..4).all(|at| {
            let [a, b, c] = [0, 1, 2].map(|next| corners[(at + next) % 4]);
            turn(a, b, c) > 0.0
        });
        convex.then_some(Patch {
            from: begin,
            to: end,
            edges: [start.0, stop.0],
            corners,
        })
    });
    patches.collect()
}

impl Patch {
    /// Returns s and t of a point within the quadrangle.
    pub fn road_coordinates(&self, point: Point) -> (f64, f64) {
        let [a, b, c, d] = self.corners;
        let distance = |one: Point, other: Point| {
            turn(one, other, point).abs() / one.distance(other).max(1e-12)
        };
        let (low, high) = (distance(a, d), distance(b, c));
        let share = if low + high > 0.0 {
            low / (low + high)
        } else {
            0.0
        };
        let between = |one: Point, other: Point| Point {
            x: one.x + share * (other.x - one.x),
            y: one.y + share * (other.y - one.y),
        };
        let (right, left) = (between(a, b), between(d, c));
        let width = right.distance(left).max(1e-12);
        let across = ((point.x - right.x) * (left.x - right.x)
            + (point.y - right.y) * (left.y - right.y))
            / (width * width);
        // `share` is measured along s, but the cross sections follow the strip.
        let along = if self.from <= self.to {
            share
        } else {
            1.0 - share
        };
        let [start, stop] = self.edges;
        let edge = |one: f64, other: f64| one + along * (other - one);
        let (right, left) = (edge(start.0, stop.0), edge(start.1, stop.1));
        (
            self.from + along * (self.to - self.from),
            right + across.clamp(0.0, 1.0) * (left - right),
        )
    }
}

/// Returns the intersection of two convex counter-clockwise polygons, or `None` if empty.
pub(crate) fn common(one: &[Point], other: &[Point]) -> Option<Vec<Point>> {
    let range = |shape: &[Point], part: fn(&Point) -> f64| {
        let values = shape.iter().map(part);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        (low, values.fold(f64::NEG_INFINITY, f64::max))
    };
    let apart = |part: fn(&Point) -> f64| {
        let (here, there) = (range(one, part), range(other, part));
        here.1 < there.0 || there.1 < here.0
    };
    if apart(|point| point.x) || apart(|point| point.y) {
        return None;
    }
    let mut shape = one.to_vec();
    for (a, b) in super::polygons::sides(other) {
        shape = cut(&shape, a, b);
        if shape.len() < 3 {
            return None;
        }
    }
    Some(shape)
}

/// Returns the area of a convex polygon in square metres.
pub(crate) fn area(shape: &[Point]) -> f64 {
    0.5 * super::junction_area::doubled_area(shape).abs()
}

/// Returns the middle of a polygon's corners.
pub(crate) fn middle(shape: &[Point]) -> Option<Point> {
    let count = shape.len() as f64;
    let sum = |part: fn(&Point) -> f64| shape.iter().map(part).sum::<f64>() / count;
    Point::finite(sum(|point| point.x), sum(|point| point.y))
}

/// Types of lanes for traffic other than vehicles.
const TRAFFIC: [&str; 6] = ["rail", "tram", "biking", "walking", "sidewalk", "curb"];
const ON_FOOT: [&str; 3] = ["walking", "sidewalk", "curb"];
/// Drivable types of lanes without regular traffic.
const ASIDE: [&str; 3] = ["border", "stop", "restricted"];

/// Returns t of the right and the left end of a road's lanes with traffic at a station. Footways
/// count only where there is no other traffic.
pub(crate) fn traffic_edges(road: &Road<'_>, station: Station) -> Option<Edges> {
    let mut extents: [Option<Edges>; 2] = [None; 2];
    for side in Side::BOTH {
        let Some(section) = road.permanent()?.section_at(road, side, station) else {
            continue;
        };
        for span in section.spans(side, station.shifted(-section.s()?)) {
            let kind = span.lane.kind().unwrap_or_default();
            let vehicles = is_drivable(span.lane) && !ASIDE.contains(&kind);
            if vehicles || TRAFFIC.contains(&kind) {
                let extent = &mut extents[usize::from(ON_FOOT.contains(&kind))];
                let (low, high) = extent.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
                let (one, other) = (span.inner.min(span.outer), span.inner.max(span.outer));
                *extent = Some((low.min(one), high.max(other)));
            }
        }
    }
    let [traffic, on_foot] = extents;
    traffic.or(on_foot)
}
