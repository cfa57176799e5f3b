use crate::families::object_parts::{Stands, listed, named, objects, outlines};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

const SIZES: [&str; 6] = [
    "lengthStart",
    "lengthEnd",
    "widthStart",
    "widthEnd",
    "heightStart",
    "heightEnd",
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // Up to 1.8 the schema requires the two heights of every repeat.
    let heights_demanded = found
        .version()
        .is_some_and(|version| version < Version::new(1, 9));
    for object in objects(map) {
        let shape = outlines(object).next().or(object.child("skeleton"));
        let Some(shape) = shape else { continue };
        for repeat in object.children_named("repeat") {
            let given: Vec<&str> = SIZES
                .into_iter()
                .filter(|name| !(heights_demanded && name.starts_with("height")))
                .filter(|name| repeat.attr(name).is_some())
                .collect();
            let Some(first) = given.first() else { continue };
            let text = format!(
                "the repeat changes {}, but {} has its own shape, `{}`; the size of a shape cannot change",
                listed(&given),
                named(object),
                shape.name()
            );
            found
                .issue(Place::attribute_or_node(repeat, first), text)
                .stands(map, object)
                .at(shape, "the shape");
        }
    }
}
