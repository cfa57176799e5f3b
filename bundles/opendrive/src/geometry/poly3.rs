//! Cubic polynomials as road shapes, deprecated since 1.6 (OpenDRIVE 1.9, 9.7).

use super::{Cubic, Point, Pose, integrate};

/// Maximum number of Newton steps for `u`.
const MAX_STEPS: u32 = 30;

/// The curve `v(u)` in the local system of the geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poly3 {
    /// The polynomial `v(u) = a + b·u + c·u² + d·u³`.
    pub v: Cubic,
}

impl Poly3 {
    /// Returns the true length in metres from `u = 0` to `u`, by adaptive quadrature to 1e-10 m.
    pub fn arc_length(&self, u: f64) -> Option<f64> {
        integrate(0.0, u, 1e-10, |at| 1.0_f64.hypot(self.v.slope(at)))
    }

    /// Returns the `u` at which the curve is `ds` metres long. The curve grows by at least one
    /// metre per metre of `u`. Newton's method within its bracket therefore always converges.
    pub fn parameter(&self, ds: f64) -> Option<f64> {
        if !ds.is_finite() || ds == 0.0 {
            return (ds == 0.0).then_some(0.0);
        }
        let (mut low, mut high) = (ds.min(0.0), ds.max(0.0));
        let mut u = ds / 1.0_f64.hypot(self.v.slope(0.0));
        for _ in 0..MAX_STEPS {
            let excess = self.arc_length(u)? - ds;
            if excess.abs() <= 1e-10 * ds.abs().max(1.0) {
                return Some(u);
            }
            if excess > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let next = u - excess / 1.0_f64.hypot(self.v.slope(u));
            u = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
        }
        None
    }

    /// Returns the pose in u and v at `u`.
    pub fn pose(&self, u: f64) -> Option<Pose> {
        let point = Point::finite(u, self.v.value(u))?;
        let slope = self.v.slope(u);
        let speed = 1.0_f64.hypot(slope);
        Pose {
            x: point.x,
            y: point.y,
            hdg: slope.atan(),
            curvature: self.v.second_derivative(u) / speed / speed / speed,
        }
        .finite()
    }
}
