use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_geometry_one_geom_elem_per_spec",
    uids: &["asam.net:xodr:1.4.0:road.geometry.one_geom_elem_per_spec"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_geometry_one_geom_elem_per_spec.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            let mut shapes = geometry.shapes();
            let Some(first) = shapes.next() else {
                let text = "the `geometry` has no shape; it must contain exactly one of `line`, `spiral`, `arc`, \
                            `poly3` and `paramPoly3`";
                found.issue(geometry.node(), text);
                continue;
            };
            for further in shapes {
                let text = format!(
                    "the `geometry` contains `{}` besides `{}`; it must contain exactly one shape",
                    further.name(),
                    first.name()
                );
                found.issue(further, text).at(first, "the first shape");
            }
        }
    }
}
