use crate::families::object_parts::{Stands, has_outline, named, number, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        let Some(surface) = object.child("surface") else {
            continue;
        };
        let lacks_side = ["length", "width"]
            .into_iter()
            .find(|name| object.attr(name).is_none());
        let is_round = object.attr("radius").is_some() && number(object, "radius") != Some(0.0);
        let why = if is_round {
            "is round (it has a `radius`)".to_owned()
        } else if has_outline(object) {
            "has an outline".to_owned()
        } else if let Some(side) = lacks_side {
            format!("has no `{side}`")
        } else {
            continue;
        };
        let text = format!(
            "{} has a surface, but {why}; only objects with `length` and `width` and without an outline may have \
             one",
            named(object)
        );
        found.issue(surface, text).stands(map, object);
    }
}
