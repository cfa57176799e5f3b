use crate::families::object_parts::{Stands, named, objects, outlines};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        let Some(outline) = outlines(object).next() else {
            continue;
        };
        let outside = object.children_named("markings").chain(
            object
                .children_named("outlines")
                .flat_map(|list| list.children_named("markings")),
        );
        for markings in outside {
            let text = format!(
                "the markings are defined in `{}`, but {} has an outline; since 1.9 they must be defined in the \
                 outline on which they lie (1.8 only allows them in the object)",
                markings.parent().map_or("", |parent| parent.name()),
                named(object)
            );
            found
                .issue(markings, text)
                .stands(map, object)
                .at(outline, "the first outline");
        }
    }
}
