//! Where the geometries of a reference line meet (OpenDRIVE 1.9, 9.2).

use qcbus_opendrive::geometry::{Cubic, ParamPoly3};
use qcbus_opendrive::{Geometry, Road, ShapeKind};

/// Each geometry with the next one, in ascending order of s.
pub(crate) fn joints<'m, 'a>(
    road: &'m Road<'a>,
) -> impl Iterator<Item = (&'m Geometry<'a>, &'m Geometry<'a>)> {
    let line = road.plan_view();
    line.in_order().zip(line.in_order().skip(1))
}

/// The name of a geometry's shape, for texts.
pub(crate) fn shape_name(geometry: &Geometry<'_>) -> &'static str {
    geometry.kind().map_or("no shape", ShapeKind::as_str)
}

/// The parameter at which both coordinates of a parametric curve stand still.
pub(crate) fn standstill(geometry: &Geometry<'_>) -> Option<f64> {
    let curve = geometry.param_poly3()?;
    let last = curve.last_parameter(geometry.length()?);
    let usual = geometry.true_length()? / last;
    let stands = |p: &f64| speed(&curve, *p) <= 1e-9 * usual;
    let still = |cubic: &Cubic| cubic.stationary().into_iter().flatten();
    let places = still(&curve.u).chain(still(&curve.v));
    let inside = places.filter(|p| (0.0..=last).contains(p));
    inside.chain([0.0, last]).find(stands)
}

fn speed(curve: &ParamPoly3, p: f64) -> f64 {
    curve.u.slope(p).hypot(curve.v.slope(p))
}
