use crate::families::object_parts::{Stands, named, objects, outlines};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
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
