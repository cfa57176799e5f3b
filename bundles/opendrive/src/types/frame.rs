//! Cross section of a road and border of a lane in space (OpenDRIVE 1.9, 8.3, 10.5).

use crate::geometry::{Point, Point3, Pose};

/// The cross section of a road at a given s, with its place and tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Pose of the reference line in the plan view.
    pub pose: Pose,
    /// Elevation in metres.
    pub z: f64,
    /// Superelevation in radians, positive if the road falls to the right.
    pub roll: f64,
    /// Slope of the elevation, dz/ds.
    pub slope: f64,
    /// Slope of the superelevation in rad/m.
    pub roll_slope: f64,
}

impl Frame {
    /// Returns the position of a point with these t and h, in metres: left of the reference line in
    /// the plan view, and above it. Superelevation rotates t and h (8.3).
    pub fn tilted(&self, t: f64, h: f64) -> (f64, f64) {
        let (sin, cos) = self.tilt();
        (t * cos - h * sin, t * sin + h * cos)
    }

    /// Returns sine and cosine of the superelevation. Most roads have no superelevation.
    pub(crate) fn tilt(&self) -> (f64, f64) {
        if self.roll == 0.0 {
            (0.0, 1.0)
        } else {
            self.roll.sin_cos()
        }
    }

    /// Returns the point `lateral` metres to the left in the plan view and `up` metres above the
    /// reference line.
    pub fn place(&self, lateral: f64, up: f64) -> Option<Point3> {
        let Point { x, y } = self.pose.beside(lateral)?;
        Point3::finite(x, y, self.z + up)
    }
}

/// A place on the border of a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BorderPoint {
    /// t of the border in road coordinates, in metres.
    pub t: f64,
    /// Point in space, on the surface of the lane.
    pub point: Point3,
    /// Heading of the border in the plan view with ascending s, in radians, not wrapped. It differs
    /// from the heading of the reference line where the border approaches or leaves that line.
    /// `None` where the border turns back (t reaches the center of the curve).
    pub hdg: Option<f64>,
    /// Slope dz/ds of the border along the reference line. Shape, cross section surface and lane
    /// height are not included.
    pub slope: f64,
    /// The same slope per metre of the border itself in the plan view. `None` where the border
    /// turns back.
    pub grade: Option<f64>,
}
