use crate::families::object_parts::{Stands, named, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        let mut records = object
            .children_named("surface")
            .flat_map(|surface| surface.children_named("CRG"));
        let Some(first) = records.next() else {
            continue;
        };
        for (index, record) in records.enumerate() {
            let text = format!(
                "this is CRG record {} of {}; an object may have only one",
                index + 2,
                named(object)
            );
            found
                .issue(record, text)
                .stands(map, object)
                .at(first, "the first record");
        }
    }
}
