//! Parametric cubic curves (OpenDRIVE 1.9, 9.6).

use super::{Cubic, Point, Pose, finite, integrate};

/// The range of the curve's parameter, from `@pRange`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ParamRange {
    /// The parameter runs from 0 to the geometry's `@length`.
    ArcLength,
    /// The parameter runs from 0 to 1.
    Normalized,
}

/// A curve whose coordinates are cubic polynomials of a common parameter `p`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamPoly3 {
    /// The coordinate along the start heading, in metres.
    pub u: Cubic,
    /// The coordinate to the left of the start heading, in metres.
    pub v: Cubic,
    /// The range of the parameter.
    pub range: ParamRange,
}

impl ParamPoly3 {
    /// Returns the parameter at the end of a geometry of `length` metres.
    pub fn last_parameter(&self, length: f64) -> f64 {
        match self.range {
            ParamRange::ArcLength => length,
            ParamRange::Normalized => 1.0,
        }
    }

    /// Returns the parameter at `ds` metres on a geometry of `length` metres. The standard relates
    /// parameter and arc length at the ends only (9.6.1). In between, they are assumed to be
    /// proportional, as in simulators.
    pub fn parameter(&self, ds: f64, length: f64) -> Option<f64> {
        match self.range {
            ParamRange::ArcLength => finite(ds),
            ParamRange::Normalized if length > 0.0 => finite(ds / length),
            ParamRange::Normalized => None,
        }
    }

    /// Returns the point in u and v at parameter `p`.
    pub fn point(&self, p: f64) -> Option<Point> {
        Point::finite(self.u.value(p), self.v.value(p))
    }

    /// Returns the pose in u and v at parameter `p`. Returns `None` where the tangent vanishes,
    /// because the curve has no direction there.
    pub fn pose(&self, p: f64) -> Option<Pose> {
        let point = self.point(p)?;
        let (du, dv) = (self.u.slope(p), self.v.slope(p));
        let speed = du.hypot(dv);
        if speed.is_nan() || speed <= 0.0 {
            return None;
        }
        let across =
            (du / speed) * self.v.second_derivative(p) - (dv / speed) * self.u.second_derivative(p);
        Pose {
            x: point.x,
            y: point.y,
            hdg: dv.atan2(du),
            curvature: across / speed / speed,
        }
        .finite()
    }

    /// Returns the true length in metres between two parameters, by adaptive quadrature to 1e-10 m.
    pub fn arc_length(&self, from: f64, to: f64) -> Option<f64> {
        integrate(from, to, 1e-10, |p| self.u.slope(p).hypot(self.v.slope(p)))
    }
}
