use crate::families::object_parts::{Stands, named, objects, outlines};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_repeating_outline_use_cornerlocal",
    uids: &["asam.net:xodr:1.9.0:road.object.repeating.outline_use_cornerlocal"],
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_object_repeating_outline_use_cornerlocal.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        let Some(repeat) = object.child("repeat") else {
            continue;
        };
        for outline in outlines(object) {
            let Some(corner) = outline.child("cornerRoad") else {
                continue;
            };
            let text = format!(
                "{} is repeated, but its outline has `cornerRoad`, which have a fixed position on the road; it \
                 must have `cornerLocal`",
                named(object)
            );
            found
                .issue(outline, text)
                .stands(map, object)
                .at(corner, "the first `cornerRoad`")
                .at(repeat, "the repetition");
        }
    }
}
