use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_cross_section_surface_no_shape_superelevation",
    uids: &["asam.net:xodr:1.8.0:road.cross_section_surface.no_shape_superelevation"],
    versions: "1.8.0..",
    after: super::READABLE,
    page: include_str!("road_cross_section_surface_no_shape_superelevation.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(lateral) = road.lateral_node() else {
            continue;
        };
        let Some(surface) = lateral.child("crossSectionSurface") else {
            continue;
        };
        for other in ["superelevation", "shape"] {
            let Some(first) = lateral.child(other) else {
                continue;
            };
            let text = format!(
                "road `{}` has a `crossSectionSurface` and `{other}`; a cross section surface must not be \
                 combined with shape or superelevation",
                road.id()
            );
            found
                .issue(surface, text)
                .at(first, format!("the first `{other}`"));
        }
    }
}
