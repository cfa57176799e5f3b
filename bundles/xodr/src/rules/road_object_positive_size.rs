use crate::families::object_parts::{
    Stands, has_outline, is_before, is_by_schema, named, number, objects,
};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Sizes, each with the flag whether the schema of 1.7 and 1.8 forbids negative values.
const SIZES: [(&str, bool); 4] = [
    ("length", true),
    ("width", false),
    ("height", true),
    ("radius", true),
];
/// Types of objects with a body.
const BODIES: [&str; 6] = [
    "building",
    "pole",
    "tree",
    "vegetation",
    "streetLamp",
    "gantry",
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let by_schema = is_by_schema(found, (1, 7), (1, 8));
    for object in objects(map) {
        for (name, known) in SIZES {
            let Some(size) = number(object, name).filter(|size| *size < 0.0) else {
                continue;
            };
            if known && by_schema {
                continue;
            }
            let text = format!(
                "`{name}` of {} is {size} m, but a size must not be negative",
                named(object)
            );
            found
                .issue(Place::attribute_or_node(object, name), text)
                .stands(map, object);
        }
        for repeat in object.children_named("repeat") {
            backwards(map, object, repeat, found);
        }
        flat(map, object, found);
    }
}

/// Reports a negative distance between repeated objects. From 1.6 on the schema reports this.
fn backwards<'a>(map: &RoadMap<'a>, object: Node<'a>, repeat: Node<'a>, found: &mut Sink<'_>) {
    let distance = number(repeat, "distance").filter(|distance| *distance < 0.0);
    let Some(distance) = distance.filter(|_| is_before(found, (1, 6))) else {
        return;
    };
    let text = format!(
        "`distance` of a `repeat` of {} is {distance} m, but must not be negative; 0 stands for one continuous object",
        named(object)
    );
    found
        .issue(Place::attribute_or_node(repeat, "distance"), text)
        .stands(map, object);
}

/// Reports an object with an extent on the ground but no height, or the other way round.
fn flat<'a>(map: &RoadMap<'a>, object: Node<'a>, found: &mut Sink<'_>) {
    let has_body = object
        .attr("type")
        .is_some_and(|kind| BODIES.contains(&kind));
    let is_elsewhere = has_outline(object)
        || object.child("skeleton").is_some()
        || object.child("repeat").is_some();
    if !has_body || is_elsewhere {
        return;
    }
    let is = |name: &str, wanted: fn(f64) -> bool| number(object, name).is_some_and(wanted);
    let zero = SIZES
        .iter()
        .map(|(name, _)| *name)
        .find(|name| is(name, |size| size == 0.0));
    let other = SIZES
        .iter()
        .map(|(name, _)| *name)
        .find(|name| is(name, |size| size > 0.0));
    let (Some(zero), Some(other)) = (zero, other) else {
        return;
    };
    // A cylinder has a radius and no sides; a box has sides and no radius.
    let round = is("radius", |size| size > 0.0);
    let sides = is("length", |size| size > 0.0) && is("width", |size| size > 0.0);
    if (round && matches!(zero, "length" | "width") || sides && zero == "radius")
        && !is("height", |size| size == 0.0)
    {
        return;
    }
    let zero = if is("height", |size| size == 0.0) {
        "height"
    } else {
        zero
    };
    let text = format!(
        "`{zero}` of {} of type `{}` is 0 m, but its `{other}` is not; a body should have an extent in all \
         directions",
        named(object),
        object.attr("type").unwrap_or_default()
    );
    found
        .issue(Place::attribute_or_node(object, zero), text)
        .level(Level::Warning)
        .stands(map, object);
}
