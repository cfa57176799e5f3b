use crate::families::shown;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Alike { since: "" },
    params: &[LEAST],
    each: Some(each),
    ..Rule::after(READABLE)
};

const LEAST: Param = Param::number(
    "least",
    1e-12,
    "1/m",
    "a difference of curvatures up to this counts as zero",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let least = found.number(&LEAST);
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            for spiral in geometry.shapes().filter(|shape| shape.is("spiral")) {
                let (Ok(start), Ok(end)) = (spiral.f64("curvStart"), spiral.f64("curvEnd")) else {
                    continue;
                };
                let change = (end - start).abs();
                if change.is_nan() || change > least {
                    continue;
                }
                let instead = if start.abs() <= least {
                    "a `line`"
                } else {
                    "an `arc`"
                };
                // Readers divide by a difference of 0 only.
                let (level, fault) = match change == 0.0 {
                    true => (
                        Level::Error,
                        "but they must differ, because readers divide by the difference",
                    ),
                    false => (Level::Information, "which is practically the same"),
                };
                let text = format!(
                    "the spiral starts with curvature {} and ends with {}, {fault}; a geometry of constant \
                     curvature is {instead}",
                    shown::number(start),
                    shown::number(end)
                );
                let finding = found.issue(spiral, text).level(level);
                if let Some(s) = geometry.s() {
                    finding.road(road.id(), s, 0.0);
                }
            }
        }
    }
}
