//! Points and directions in the inertial system (OpenDRIVE 1.9, 8.2).

use std::f64::consts::{PI, TAU};

use super::finite;

/// A point in the plan view, in metres; x points east, y north.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// East, in metres.
    pub x: f64,
    /// North, in metres.
    pub y: f64,
}

impl Point {
    /// Returns the point with these coordinates if both are finite.
    pub fn finite(x: f64, y: f64) -> Option<Point> {
        (x.is_finite() && y.is_finite()).then_some(Point { x, y })
    }

    /// Returns the distance to `other`, in metres.
    pub fn distance(self, other: Point) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// A point in space, in metres; z points up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point3 {
    /// East, in metres.
    pub x: f64,
    /// North, in metres.
    pub y: f64,
    /// Up, in metres.
    pub z: f64,
}

impl Point3 {
    /// Returns the point with these coordinates if all are finite.
    pub fn finite(x: f64, y: f64, z: f64) -> Option<Point3> {
        (x.is_finite() && y.is_finite() && z.is_finite()).then_some(Point3 { x, y, z })
    }

    /// Returns the point in the plan view.
    pub fn plan(self) -> Point {
        Point {
            x: self.x,
            y: self.y,
        }
    }
}

/// A place on a curve with the curve's direction and curvature there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// East, in metres.
    pub x: f64,
    /// North, in metres.
    pub y: f64,
    /// Heading in radians, counter-clockwise from east, not wrapped.
    pub hdg: f64,
    /// Curvature in 1/m, positive in left curves.
    pub curvature: f64,
}

impl Pose {
    /// Returns the pose if all its numbers are finite.
    pub fn finite(self) -> Option<Pose> {
        let all = [self.x, self.y, self.hdg, self.curvature];
        all.iter().all(|value| value.is_finite()).then_some(self)
    }

    /// Returns the point of the pose.
    pub fn point(self) -> Point {
        Point {
            x: self.x,
            y: self.y,
        }
    }

    /// Returns the point `t` metres to the left of the pose (negative: to the right).
    pub fn beside(self, t: f64) -> Option<Point> {
        let (sin, cos) = self.hdg.sin_cos();
        Point::finite(self.x - sin * t, self.y + cos * t)
    }
}

/// Returns the angle wrapped into (-π, π].
pub fn wrap_angle(angle: f64) -> Option<f64> {
    let wrapped = finite(angle)?.rem_euclid(TAU);
    Some(if wrapped > PI { wrapped - TAU } else { wrapped })
}

/// Returns the difference of the two headings, in radians from 0 to π.
pub fn heading_difference(a: f64, b: f64) -> Option<f64> {
    wrap_angle(finite(a)? - finite(b)?).map(f64::abs)
}
