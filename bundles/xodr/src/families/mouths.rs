//! Mouths of roads, which are the lines across their ends, and the distance between two mouths.
//!
//! The reference lines of two roads that meet may lie apart: a connecting road may begin beside the
//! reference line of the incoming road. If the mouths do not touch, the roads do not meet.

use crate::prelude::*;

/// The line across an end of a road in the plan view, from the rightmost to the leftmost lane edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mouth {
    right: Point,
    left: Point,
}

impl Mouth {
    pub fn of(road: &Road<'_>, end: ContactPoint) -> Option<Mouth> {
        let pose = road.end_frame(end)?.pose;
        let (sin, cos) = pose.hdg.sin_cos();
        let corner = |side| {
            let t = edge(road, side, end)?;
            Point::finite(pose.x - t * sin, pose.y + t * cos)
        };
        Some(Mouth {
            right: corner(Side::Right)?,
            left: corner(Side::Left)?,
        })
    }

    /// Returns the mouth of a road end of the map.
    pub fn at(map: &RoadMap<'_>, at: RoadEnd) -> Option<Mouth> {
        Mouth::of(map.road_at(at.road)?, at.end)
    }

    /// Returns the distance between two mouths in metres, or 0 if they cross.
    pub fn distance(self, other: Mouth) -> f64 {
        if self.splits(other) && other.splits(self) {
            return 0.0;
        }
        let ends = [
            self.from(other.right),
            self.from(other.left),
            other.from(self.right),
            other.from(self.left),
        ];
        ends.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Returns the distance of a point from the line.
    fn from(self, point: Point) -> f64 {
        let (x, y) = (self.left.x - self.right.x, self.left.y - self.right.y);
        let along = x * (point.x - self.right.x) + y * (point.y - self.right.y);
        let share = (along / (x * x + y * y)).clamp(0.0, 1.0);
        // A mouth without width is a point.
        let share = if share.is_nan() { 0.0 } else { share };
        point.distance(Point {
            x: self.right.x + share * x,
            y: self.right.y + share * y,
        })
    }

    /// Checks whether the ends of the other mouth lie on different sides of this one.
    fn splits(self, other: Mouth) -> bool {
        let side = |point: Point| {
            (self.left.x - self.right.x) * (point.y - self.right.y)
                - (self.left.y - self.right.y) * (point.x - self.right.x)
        };
        side(other.right) * side(other.left) < 0.0
    }
}

/// Returns the distance between the mouths of two road ends, in metres.
pub(crate) fn apart(map: &RoadMap<'_>, one: RoadEnd, other: RoadEnd) -> Option<f64> {
    Some(Mouth::at(map, one)?.distance(Mouth::at(map, other)?))
}

/// Returns t of the outermost lane edge of a side, or of the center lane if the side is empty.
/// Returns `None` without a lane section or with an unknown lane width.
fn edge(road: &Road<'_>, side: Side, end: ContactPoint) -> Option<f64> {
    let section = road.permanent()?.end_section(road, side, end)?;
    let ds = match end {
        ContactPoint::Start => Station::at(0.0),
        ContactPoint::End => Station::before(section.length(side)?),
    };
    if section.side(side).next().is_none() {
        return section.center_t(ds);
    }
    section.edge_t(side, ds)
}
