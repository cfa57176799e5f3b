use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_geometry_only_one_refline",
    uids: &["asam.net:xodr:1.4.0:road.geometry.only_one_refline"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_geometry_only_one_refline.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let mut lines = road.node().children_named("planView");
        let Some(first) = lines.next() else { continue };
        for further in lines {
            let text = format!(
                "road `{}` has a second `planView`; a road has exactly one reference line",
                road.id()
            );
            found.issue(further, text).at(first, "the first one");
        }
    }
}
