use crate::families::object_parts::{Stands, listed, named, number, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        for repeat in object.children_named("repeat") {
            // In many files a radius of zero means "none".
            let radius = object
                .attribute("radius")
                .filter(|_| number(object, "radius") != Some(0.0));
            let radius = radius.or_else(|| {
                ["radiusStart", "radiusEnd"]
                    .into_iter()
                    .find_map(|name| repeat.attribute(name))
            });
            let given: Vec<&str> = ["widthStart", "widthEnd"]
                .into_iter()
                .filter(|name| repeat.attr(name).is_some())
                .collect();
            let (Some(radius), Some(first)) = (radius, given.first()) else {
                continue;
            };
            let text = format!(
                "the repeat gives {}, but {} is round (`{}=\"{}\"`); round objects have no width",
                listed(&given),
                named(object),
                radius.name(),
                radius.value()
            );
            found
                .issue(Place::attribute_or_node(repeat, first), text)
                .stands(map, object)
                .at(radius, "the radius");
        }
    }
}
