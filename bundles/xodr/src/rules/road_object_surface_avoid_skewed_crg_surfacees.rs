use crate::families::on_road::OnRoad;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.7.0" },
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for (road, object) in map.part(part).objects() {
        let has_surface = object.crgs().next().is_some();
        let sizes = object.length().zip(object.width());
        let (Some((length, width)), Some(s)) = (sizes, object.s()) else {
            continue;
        };
        if object.perp_to_road() != Some(true) || !has_surface {
            continue;
        }
        let size = length.max(width);
        let curvature = sharpest(road, s - 0.5 * length, s + 0.5 * length);
        if curvature > 0.0 && size * curvature >= 1.0 {
            let text = format!(
                "object `{}` has a size of {size:.2} m, but the elevation below it has a radius of {:.2} m; \
                 `perpToRoad` should only be used for smaller objects, because it skews the surfaces of larger \
                 ones",
                object.id().unwrap_or_default(),
                1.0 / curvature
            );
            found
                .issue(Place::attribute_or_node(object.node(), "perpToRoad"), text)
                .on(road, s, object.t().unwrap_or(0.0));
        }
    }
}

/// Returns the largest curvature of the elevation between two positions, in 1/m. The second
/// derivative of a cubic is largest at an end of its stretch.
fn sharpest(road: &Road<'_>, from: f64, to: f64) -> f64 {
    let mut sharpest = 0.0_f64;
    for stretch in road.elevation().stretches(road.length().unwrap_or(to)) {
        let (low, high) = (from.max(stretch.from), to.min(stretch.to));
        for s in [low, high].into_iter().filter(|_| low <= high) {
            let ds = s - stretch.from;
            let slope = stretch.cubic.slope(ds);
            let curvature =
                stretch.cubic.second_derivative(ds).abs() / (1.0 + slope * slope).powf(1.5);
            sharpest = sharpest.max(curvature);
        }
    }
    sharpest
}
