//! Contacts between the geometries of a reference line (OpenDRIVE 1.9, 9.2).

use super::gap_levels::Misfit;
use super::on_road::OnRoad;
use crate::prelude::*;

/// Returns each geometry with the next one, in ascending order of s.
pub(crate) fn joints<'m, 'a>(
    road: &'m Road<'a>,
) -> impl Iterator<Item = (&'m Geometry<'a>, &'m Geometry<'a>)> {
    let line = road.plan_view();
    line.in_order().zip(line.in_order().skip(1))
}

/// Returns the name of a geometry's shape, for texts.
pub(crate) fn shape_name(geometry: &Geometry<'_>) -> &'static str {
    geometry.kind().map_or("no shape", ShapeKind::as_str)
}

/// Reports geometries that begin more than `limit` metres from the end of the previous one.
/// `complete` may extend a finding.
pub(crate) fn report_gaps<'d>(
    road: &Road<'_>,
    limit: f64,
    found: &mut Sink<'d>,
    complete: impl Fn(Finding<'_, 'd>),
) {
    for (one, next) in joints(road) {
        let (Some(end), Some(start)) = (one.end_point(), next.start_point()) else {
            continue;
        };
        let gap = end.distance(start);
        if gap <= limit {
            continue;
        }
        let text = format!(
            "the previous geometry ({}) ends at ({:.3}, {:.3}), {gap:.3} m away from ({:.3}, {:.3}), where this \
             one ({}) starts; at most {limit} m is allowed",
            shape_name(one),
            end.x,
            end.y,
            start.x,
            start.y,
            shape_name(next)
        );
        let misfit = Misfit::gap(gap, gap, found);
        let finding = misfit
            .put(found.issue(next.node(), text))
            .on(road, next.s().unwrap_or(0.0), 0.0)
            .at(one.node(), "the previous geometry")
            .point(end.x, end.y, 0.0);
        complete(finding);
    }
}

/// Returns the parameter at which both coordinates of a parametric curve have zero speed.
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
