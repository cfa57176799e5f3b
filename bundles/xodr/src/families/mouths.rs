//! The mouths of roads, the lines across their ends, and how far two of them lie apart.
//!
//! Reference lines of roads that meet need not: that of a connecting road may begin beside the one of the
//! incoming road. But where the mouths do not even touch, the roads do not meet.

use qcbus_opendrive::geometry::Point;
use qcbus_opendrive::{ContactPoint, Road, RoadEnd, RoadMap, Side, Station};

/// The line across an end of a road, from its rightmost lane's edge to its leftmost lane's, in the plan view.
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

    /// The mouth of a road end of the map.
    pub fn at(map: &RoadMap<'_>, at: RoadEnd) -> Option<Mouth> {
        Mouth::of(map.road_at(at.road)?, at.end)
    }

    /// How far apart two mouths lie, in metres; 0 where they cross.
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

    /// How far away a point lies from the line.
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

    /// Whether the ends of the other mouth lie on different sides of this one.
    fn splits(self, other: Mouth) -> bool {
        let side = |point: Point| {
            (self.left.x - self.right.x) * (point.y - self.right.y)
                - (self.left.y - self.right.y) * (point.x - self.right.x)
        };
        side(other.right) * side(other.left) < 0.0
    }
}

/// How far apart two road ends lie, in metres.
pub(crate) fn apart(map: &RoadMap<'_>, one: RoadEnd, other: RoadEnd) -> Option<f64> {
    Some(Mouth::at(map, one)?.distance(Mouth::at(map, other)?))
}

/// Where the lanes of a side end, counted from the reference line. `None` for roads without lanes, of which
/// nobody knows how wide they are, and where a lane's width is unknown.
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
