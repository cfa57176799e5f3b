//! Shapes of a reference line, in local coordinates and in the plan view.

use super::{ParamPoly3, Point, Poly3, Pose, Spiral, finite};

/// The shape of one `<geometry>`: a curve that starts at the origin of its local u/v system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// A straight line (OpenDRIVE 1.9, 9.3).
    Line,
    /// A circular arc (9.5). An arc with a vanishing curvature is evaluated as a straight line.
    Arc {
        /// The constant curvature in 1/m, positive to the left.
        curvature: f64,
    },
    /// A clothoid (9.4).
    Spiral(Spiral),
    /// A parametric cubic curve (9.6).
    ParamPoly3(ParamPoly3),
    /// A cubic polynomial (9.7).
    Poly3(Poly3),
}

impl Curve {
    /// Returns the pose `ds` metres after the start of a curve of `length` metres, in u and v.
    pub fn pose(&self, ds: f64, length: f64) -> Option<Pose> {
        match self {
            Curve::Line => Pose {
                x: ds,
                ..Pose::default()
            }
            .finite(),
            Curve::Arc { curvature } => arc(*curvature, ds),
            Curve::Spiral(spiral) => spiral.pose(ds),
            Curve::ParamPoly3(curve) => curve.pose(curve.parameter(ds, length)?),
            Curve::Poly3(curve) => curve.pose(curve.parameter(ds)?),
        }
    }

    /// Returns the point `ds` metres after the start, in local u and v. It is defined even where a
    /// parametric curve has no direction.
    pub fn point(&self, ds: f64, length: f64) -> Option<Point> {
        match self {
            Curve::ParamPoly3(curve) => curve.point(curve.parameter(ds, length)?),
            other => other.pose(ds, length).map(Pose::point),
        }
    }

    /// Returns the true length of the curve in metres, for a stated `length`. For `paramPoly3`, it
    /// is the integral over the whole parameter range. For other shapes, it is `length`.
    pub fn true_length(&self, length: f64) -> Option<f64> {
        match self {
            Curve::ParamPoly3(curve) => curve.arc_length(0.0, curve.last_parameter(length)),
            _ => finite(length),
        }
    }
}

/// Returns the pose on a circle. The half-angle form keeps its precision for every curvature.
fn arc(curvature: f64, ds: f64) -> Option<Pose> {
    let half = finite(0.5 * curvature * ds)?;
    let (sin, cos) = half.sin_cos();
    let ratio = if half == 0.0 { 1.0 } else { sin / half };
    Pose {
        x: ds * ratio * cos,
        y: ds * ratio * sin,
        hdg: 2.0 * half,
        curvature,
    }
    .finite()
}

/// A curve in the plan view, with its start, start heading and length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Origin of the local system, in metres.
    pub origin: Point,
    /// Heading of the local u axis, in radians.
    pub hdg: f64,
    /// Length that the geometry states, in metres.
    pub length: f64,
    /// The shape.
    pub curve: Curve,
}

impl Placed {
    /// Returns the pose `ds` metres after the start.
    pub fn pose(&self, ds: f64) -> Option<Pose> {
        let local = self.curve.pose(ds, self.length)?;
        let point = self.place(local.point())?;
        Pose {
            x: point.x,
            y: point.y,
            hdg: self.hdg + local.hdg,
            curvature: local.curvature,
        }
        .finite()
    }

    /// Returns the point `ds` metres after the start.
    pub fn point(&self, ds: f64) -> Option<Point> {
        self.place(self.curve.point(ds, self.length)?)
    }

    /// Rotates and shifts a local point into the plan view.
    pub fn place(&self, local: Point) -> Option<Point> {
        let (sin, cos) = self.hdg.sin_cos();
        Point::finite(
            self.origin.x + local.x * cos - local.y * sin,
            self.origin.y + local.x * sin + local.y * cos,
        )
    }
}
