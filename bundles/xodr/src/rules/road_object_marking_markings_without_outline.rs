use crate::families::object_parts::{Stands, has_outline};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_marking_markings_without_outline",
    uids: &["asam.net:xodr:1.9.0:road.object.marking.markings_without_outline"],
    versions: "1.9.0..",
    after: super::READABLE,
    page: include_str!("road_object_marking_markings_without_outline.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(root) = map.root() else { return };
    for markings in root.document().elements("markings") {
        let Some(parent) = markings.parent().filter(|parent| !parent.is("object")) else {
            continue;
        };
        let foreign = markings.ancestors().any(|above| above.is("userData"));
        let object = markings.ancestors().find(|above| above.is("object"));
        let place = match object {
            _ if foreign => continue,
            Some(object) if has_outline(object) => continue,
            Some(object) => object,
            None if parent.is("objects") => parent,
            None => continue,
        };
        let text = format!(
            "the markings are defined in `{}`; without an outline, they must be defined in the `object`",
            parent.name()
        );
        found.issue(markings, text).stands(map, place);
    }
}
