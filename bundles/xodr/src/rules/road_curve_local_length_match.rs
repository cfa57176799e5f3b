use crate::families::on_road::OnRoad;
use crate::families::outline_curves::{LENGTH_TOLERANCE, for_each_poly};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    params: &[LENGTH_TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for_each_poly(map, found, |road, object, curve, poly, found| {
        let Some(length) = curve.length() else { return };
        let tolerance = found.number(&LENGTH_TOLERANCE);
        let Some(real) = poly.arc_length(0.0, poly.last_parameter(length)) else {
            return;
        };
        if (real - length).abs() > tolerance {
            let text = format!(
                "the curve is {real:.4} m long, but its `length` is {length} m; they should agree within \
                 {tolerance} m"
            );
            found
                .issue(Place::attribute_or_node(curve.node(), "length"), text)
                .on(road, object.s().unwrap_or(0.0), object.t().unwrap_or(0.0));
        }
    });
}
