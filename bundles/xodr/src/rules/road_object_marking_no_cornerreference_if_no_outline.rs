use crate::families::object_parts::{Stands, has_outline, named, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map).filter(|object| !has_outline(*object)) {
        for (list, part) in [("markings", "marking"), ("borders", "border")] {
            let parts = object
                .children_named(list)
                .flat_map(|list| list.children_named(part));
            for reference in parts.filter_map(|part| part.child("cornerReference")) {
                let text = format!(
                    "the {part} refers to a corner, but {} has no outline; without an outline, there must be no \
                     `cornerReference`",
                    named(object)
                );
                found.issue(reference, text).stands(map, object);
            }
        }
    }
}
