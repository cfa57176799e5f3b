use crate::families::object_parts::{CORNERS, Stands, listed, objects, outlines};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.9.0:road.corner_road.corner_road_local_exclusivity",
        // Annex F prints this UID with the version 1.x.0, which no reader of results accepts.
        "asam.net:xodr:1.9.0:road.corner_local.no_mixing_road_local",
    ],
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        for outline in outlines(object) {
            let present = CORNERS.map(|sort| outline.child(sort));
            let mut sorts: Vec<Node<'_>> = present.into_iter().flatten().collect();
            sorts.sort();
            let [first, other, ..] = sorts.as_slice() else {
                continue;
            };
            let names: Vec<&str> = sorts.iter().map(Node::name).collect();
            let text = format!(
                "the outline mixes {}; all of its points must be of the same kind",
                listed(&names)
            );
            found
                .issue(outline, text)
                .stands(map, object)
                .at(*first, "the first element of one kind")
                .at(*other, "the first element of another kind");
        }
    }
}
