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
    "a curvature up to this counts as zero",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let least = found.number(&LEAST);
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            for arc in geometry.shapes().filter(|shape| shape.is("arc")) {
                let curvature = arc.f64("curvature").ok();
                let Some(curvature) = curvature.filter(|curvature| curvature.abs() <= least) else {
                    continue;
                };
                let shown = shown::number(curvature);
                // Readers divide by 0 only. A tiny curvature is merely a line written as an arc.
                let (level, fault) = match curvature == 0.0 {
                    true => (
                        Level::Error,
                        "but must not be zero, because readers divide by it",
                    ),
                    false => (Level::Information, "which is practically zero"),
                };
                let text = format!(
                    "the curvature of the arc is {shown}, {fault}; a straight geometry is a `line`"
                );
                let finding = found
                    .issue(Place::attribute_or_node(arc, "curvature"), text)
                    .level(level);
                if let Some(s) = geometry.s() {
                    finding.road(road.id(), s, 0.0);
                }
            }
        }
    }
}
