use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.1.0" },
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
                let text = format!(
                    "the curvature of the arc is {curvature}; it should not be zero; a straight geometry should \
                     be a `line`"
                );
                let finding = found.issue(Place::attribute_or_node(arc, "curvature"), text);
                if let Some(s) = geometry.s() {
                    finding.road(road.id(), s, 0.0);
                }
            }
        }
    }
}
