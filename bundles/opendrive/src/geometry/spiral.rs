//! Clothoids: curves whose curvature changes linearly along their length (OpenDRIVE 1.9, 9.4).

use std::f64::consts::PI;

use super::fresnel::fresnel;
use super::quadrature::gauss8;
use super::{Point, Pose, finite};

/// Largest turn (largest curvature times length, in radians) for which positions come from
/// quadrature. Quadrature has no cancellation, however small the change of curvature is.
const MAX_QUADRATURE_TURN: f64 = 200.0;

/// Maximum turn of one eight-point rule, in radians. Its error stays below 1e-15.
const TURN_PER_RULE: f64 = 2.0;

/// Largest accepted phase. Beyond it, a sine has fewer than six correct digits.
const MAX_PHASE: f64 = 1e9;

/// A clothoid that starts at the origin in the direction of the x axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spiral {
    /// The curvature at the start, in 1/m.
    pub start: f64,
    /// The change of curvature per metre, in 1/m².
    pub rate: f64,
}

impl Spiral {
    /// Returns the clothoid whose curvature goes from `start` to `end` over `length` metres.
    /// Returns `None` if the length is not positive.
    pub fn between(start: f64, end: f64, length: f64) -> Option<Spiral> {
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let rate = finite((end - start) / length)?;
        Some(Spiral {
            start: finite(start)?,
            rate,
        })
    }

    /// Returns the curvature after `ds` metres.
    pub fn curvature(&self, ds: f64) -> f64 {
        self.start + self.rate * ds
    }

    /// Returns the heading after `ds` metres, the integral of the curvature.
    pub fn heading(&self, ds: f64) -> f64 {
        ds * (self.start + 0.5 * self.rate * ds)
    }

    /// Returns the pose after `ds` metres. Returns `None` if it is not finite. Also returns `None`
    /// if the curve has turned too often for a direction in double precision.
    pub fn pose(&self, ds: f64) -> Option<Pose> {
        let point = self.point(ds)?;
        Pose {
            x: point.x,
            y: point.y,
            hdg: self.heading(ds),
            curvature: self.curvature(ds),
        }
        .finite()
    }

    /// Returns the point after `ds` metres; see [`Spiral::pose`].
    pub fn point(&self, ds: f64) -> Option<Point> {
        let sharpest = self.start.abs().max(self.curvature(ds).abs());
        let turn = finite(sharpest * ds.abs())?;
        if turn <= MAX_QUADRATURE_TURN {
            self.point_by_quadrature(ds, turn)
        } else {
            self.point_by_fresnel(ds)
        }
    }

    fn point_by_quadrature(&self, ds: f64, turn: f64) -> Option<Point> {
        let pieces = (turn / TURN_PER_RULE).ceil().max(1.0);
        let step = ds / pieces;
        let (mut x, mut y, mut from) = (0.0, 0.0, 0.0);
        let mut piece = 0.0;
        while piece < pieces {
            piece += 1.0;
            let to = step * piece;
            x += gauss8(from, to, |s| self.heading(s).cos());
            y += gauss8(from, to, |s| self.heading(s).sin());
            from = to;
        }
        Point::finite(x, y)
    }

    /// Computes both coordinates as differences of Fresnel integrals, rotated by `θ₀`:
    /// `θ(s) = θ₀ + rate/2·(s - s₀)²` around the point of zero curvature `s₀`.
    fn point_by_fresnel(&self, ds: f64) -> Option<Point> {
        let scale = (self.rate.abs() / PI).sqrt();
        let inflection = -self.start / self.rate;
        let phase = 0.5 * self.start * inflection;
        let last = 0.5 * self.rate * (ds - inflection).powi(2);
        let holds = phase.abs() <= MAX_PHASE && last.abs() <= MAX_PHASE && scale > 0.0;
        if !holds {
            return None;
        }
        let (c0, s0) = fresnel(-inflection * scale)?;
        let (c1, s1) = fresnel((ds - inflection) * scale)?;
        let (dx, dy) = ((c1 - c0) / scale, (s1 - s0) / scale * self.rate.signum());
        let (sin, cos) = phase.sin_cos();
        Point::finite(dx * cos - dy * sin, dx * sin + dy * cos)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn equal_curvatures_make_an_arc() {
        let arc = Spiral::between(0.1, 0.1, 40.0).unwrap().pose(15.0).unwrap();
        assert!((arc.x - 10.0 * 1.5_f64.sin()).abs() < 1e-12);
        assert!((arc.y - 10.0 * (1.0 - 1.5_f64.cos())).abs() < 1e-12);
        assert!((arc.hdg - 1.5).abs() < 1e-15);
    }

    #[test]
    fn spiral_without_positive_length_is_refused() {
        for length in [0.0, -1.0, f64::NAN] {
            assert_eq!(Spiral::between(0.0, 0.1, length), None);
        }
        assert_eq!(Spiral::between(-1e308, 1e308, 1e-300), None);
        let wild = Spiral::between(1e300, -1e300, 10.0).unwrap();
        assert_eq!(wild.point(5.0), None);
    }

    proptest! {
        #[test]
        fn quadrature_and_fresnel_points_agree(
            start in -0.3..0.3_f64, rate in prop_oneof![-0.05..-1e-4_f64, 1e-4..0.05_f64], ds in 0.0..60.0_f64,
        ) {
            let spiral = Spiral { start, rate };
            let turn = start.abs().max(spiral.curvature(ds).abs()) * ds;
            let one = spiral.point_by_quadrature(ds, turn).unwrap();
            let other = spiral.point_by_fresnel(ds).unwrap();
            // The closed form loses digits as the inflection moves away.
            prop_assert!(one.distance(other) < 1e-9, "{one:?} {other:?}");
        }

        #[test]
        fn mirrored_spiral_is_mirrored_curve(
            start in -0.3..0.3_f64, rate in -0.05..0.05_f64, ds in 0.0..60.0_f64,
        ) {
            let one = Spiral { start, rate }.pose(ds).unwrap();
            let other = Spiral { start: -start, rate: -rate }.pose(ds).unwrap();
            prop_assert!((one.x - other.x).abs() < 1e-12 && (one.y + other.y).abs() < 1e-12);
        }
    }
}
