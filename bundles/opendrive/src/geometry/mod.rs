//! Plane curves and polynomials over plain numbers, without documents or allocation.
//!
//! A result that cannot be computed in finite double precision is `None`. No function panics. Every
//! function does a bounded amount of work for any arguments.

mod cubic;
mod curve;
mod fresnel;
mod param_poly3;
mod point;
mod poly3;
mod quadrature;
mod spiral;

pub use cubic::{Cubic, Minimum};
pub use curve::{Curve, Placed};
pub use fresnel::fresnel;
pub use param_poly3::{ParamPoly3, ParamRange};
pub use point::{Point, Point3, Pose, heading_difference, wrap_angle};
pub use poly3::Poly3;
pub use quadrature::integrate;
pub use spiral::Spiral;

/// Returns the value, unless it is infinite or not a number.
pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
