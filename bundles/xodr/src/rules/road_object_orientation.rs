use crate::families::object_parts::{Stands, is_blank, named, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map).filter(|object| is_blank(*object, "orientation")) {
        let text = format!(
            "{} has no `orientation`; it must define whether the object is valid along the road (`+`), against \
             it (`-`) or in both directions (`none`)",
            named(object)
        );
        let place = Place::attribute_or_node(object, "orientation");
        let finding = found
            .issue(place, text)
            .stands(map, object)
            .fault("objects without orientation");
        if let Some(validity) = object.child("validity") {
            finding
                .level(Level::Error)
                .at(validity, "the lanes for which it is valid");
        }
    }
}
