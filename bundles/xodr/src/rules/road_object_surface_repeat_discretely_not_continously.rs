use crate::families::object_parts::{Stands, named, number, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

/// Distance in metres up to which a value counts as zero.
const SAME: f64 = 1e-6;

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        let Some(surface) = object.child("surface") else {
            continue;
        };
        for repeat in object.children_named("repeat") {
            if number(repeat, "distance").is_some_and(|distance| distance.abs() <= SAME) {
                let text = format!(
                    "{} has a surface and is repeated continuously (`distance` is 0); it may only be repeated as \
                     separate copies",
                    named(object)
                );
                found
                    .issue(Place::attribute_or_node(repeat, "distance"), text)
                    .stands(map, object)
                    .at(surface, "the surface");
            }
        }
    }
}
