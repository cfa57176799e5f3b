use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_geometry_refline_exists",
    uids: &["asam.net:xodr:1.4.0:road.geometry.refline_exists"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_geometry_refline_exists.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        if !road.plan_view().geometries().is_empty() {
            continue;
        }
        let (place, what) = match road.plan_view_node() {
            Some(node) => (node, "an empty `planView`"),
            None => (road.node(), "no `planView`"),
        };
        let text = format!(
            "road `{}` has {what}; each road must have a reference line of at least one `geometry`",
            road.id()
        );
        found.issue(place, text);
    }
}
