use crate::families::ascending::TOLERANCE;
use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        if let Some(lateral) = road.lateral_node() {
            check(road, lateral, found);
        }
    }
}

fn check(road: &Road<'_>, lateral: Node<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let flat = is_flat(lateral);
    let mut last: Option<(Node<'_>, f64, f64)> = None;
    for shape in lateral.children_named("shape") {
        let (Ok(s), Ok(t)) = (shape.f64("s"), shape.f64("t")) else {
            continue;
        };
        let Some((before, last_s, last_t)) = last.replace((shape, s, t)) else {
            continue;
        };
        let ahead = format!(
            "the one listed before it has s = {}, t = {}",
            number(last_s),
            number(last_t)
        );
        // Any increase of s counts as a step ahead, even a small one.
        if s < last_s - tolerance || (s <= last_s && t < last_t - tolerance) {
            let by = if s < last_s - tolerance { "s" } else { "t" };
            let text = format!(
                "this `shape` has s = {}, t = {}, but {ahead}; `shape` elements must be listed in \
                 ascending order of `s`, those with the same `s` in ascending order of `t`",
                number(s),
                number(t)
            );
            let finding = found
                .issue(Place::attribute_or_node(shape, by), text)
                .road(road.id(), s, t)
                .at(before, "the one listed before it");
            if flat {
                finding.level(Level::Warning);
                return;
            }
        } else if s <= last_s + tolerance && (t - last_t).abs() <= tolerance {
            // A repeated record with the same values is only a formal fault.
            let level = match ["a", "b", "c", "d"]
                .iter()
                .all(|name| shape.f64(name).ok() == before.f64(name).ok())
            {
                true => Level::Warning,
                false => Level::Error,
            };
            let text = format!(
                "this `shape` has s = {}, t = {} like the one listed before it, which therefore never applies; \
                 each must have its own position",
                number(s),
                number(t)
            );
            found
                .issue(Place::attribute_or_node(shape, "t"), text)
                .level(level)
                .road(road.id(), s, t)
                .at(before, "the one that never applies");
        }
    }
}

/// Checks whether the shape is 0 everywhere, independent of the order.
fn is_flat(lateral: Node<'_>) -> bool {
    let zero = |shape: &Node<'_>, name: &str| shape.f64(name).is_ok_and(|value| value == 0.0);
    let mut shapes = lateral.children_named("shape");
    shapes.all(|shape| ["a", "b", "c", "d"].iter().all(|name| zero(&shape, name)))
}
