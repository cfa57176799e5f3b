use crate::families::object_parts::{Stands, named, number, objects};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_surface_repeat_discretely_not_continously",
    uids: &["asam.net:xodr:1.7.0:road.object.surface.repeat_discretely_not_continously"],
    versions: "1.7.0..",
    after: super::READABLE,
    page: include_str!("road_object_surface_repeat_discretely_not_continously.md"),
    run,
    ..Rule::DEFAULTS
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
