use crate::families::object_parts::{listed, named, number, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "s_tolerance",
    1e-3,
    "m",
    "largest distance of `s` beyond the ends of the road that is accepted",
);

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for object in objects(map) {
        let missing: Vec<&str> = ["s", "t"]
            .into_iter()
            .filter(|name| object.attr(name).is_none())
            .collect();
        if !missing.is_empty() {
            let text = format!(
                "{} has no {}; its origin must be given by `s` and `t`",
                named(object),
                listed(&missing)
            );
            found.issue(object, text);
        }
        on_road(map, object, tolerance, found);
    }
}

/// Checks that the origin is on the road, from its start to its end.
fn on_road<'a>(map: &RoadMap<'a>, object: Node<'a>, tolerance: f64, found: &mut Sink<'_>) {
    let (Some(s), Some(road)) = (number(object, "s"), map.road_of(object)) else {
        return;
    };
    let Some(length) = road.length() else { return };
    if s < -tolerance || s > length + tolerance {
        let text = format!(
            "{} is at s = {s} m, but road `{}` extends from 0 to {length} m",
            named(object),
            road.id()
        );
        found
            .issue(Place::attribute_or_node(object, "s"), text)
            .road(road.id(), s, number(object, "t").unwrap_or(0.0));
    }
}
