use crate::families::on_road::OnRoad;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m and rad",
    "largest shift and rotation of the curve's start that is accepted",
);
const HARMFUL: Param = Param::number(
    "harmful",
    0.01,
    "m and rad",
    "shift or rotation above which the finding is an error",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[TOLERANCE, HARMFUL],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            if let Some(curve) = geometry.param_poly3() {
                check(road, geometry, &curve, found);
            }
        }
    }
}

/// Checks aU = aV = bV = 0 and bU > 0. Then the curve starts at `@x`, `@y` in the direction of
/// `@hdg`.
fn check(road: &Road<'_>, geometry: &Geometry<'_>, curve: &ParamPoly3, found: &mut Sink<'_>) {
    let (tolerance, harmful) = (found.number(&TOLERANCE), found.number(&HARMFUL));
    let shift = curve.u.a.hypot(curve.v.a);
    let turn = curve.v.b.atan2(curve.u.b).abs();
    let forward = curve.u.b > 0.0;
    if forward && shift <= tolerance && turn <= tolerance {
        return;
    }
    let text = format!(
        "aU = {}, bU = {}, aV = {}, bV = {}: the curve starts {shift:.6} m away from the geometry's x and y and \
         is rotated by {turn:.6} rad from its hdg; it should have aU = aV = bV = 0 and bU > 0",
        curve.u.a, curve.u.b, curve.v.a, curve.v.b
    );
    let harms = !forward || shift > harmful || turn > harmful;
    let level = if harms { Level::Error } else { Level::Warning };
    let place = geometry.shape_node().unwrap_or(geometry.node());
    found
        .issue(place, text)
        .level(level)
        .on(road, geometry.s().unwrap_or(0.0), 0.0);
}
