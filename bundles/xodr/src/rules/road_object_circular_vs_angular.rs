use crate::families::object_parts::{self, Stands, listed, named, number, objects};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning("readers take one of the two shapes")),
    versions: "1.7.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // Two contradicting volumes are a fault in every version, because all versions allow only one
    // of the two. Cases with a clear meaning are no fault in versions without this rule.
    let mild = if object_parts::is_before(found, (1, 7)) {
        Level::Information
    } else {
        Level::Warning
    };
    for object in objects(map) {
        let [radius, length, width] = ["radius", "length", "width"].map(|name| object.attr(name));
        let sides: Vec<&str> = [("length", length), ("width", width)]
            .into_iter()
            .filter_map(|(name, value)| value.map(|_| name))
            .collect();
        match (radius, sides.as_slice()) {
            (Some(_), [_, ..]) => both(map, object, &sides, mild, found),
            (None, [only]) if !is_completed(object) => {
                let other = if *only == "length" { "width" } else { "length" };
                let text = format!(
                    "{} has a `{only}`, but no `{other}`; a box needs both, a cylinder has a `radius`",
                    named(object)
                );
                found
                    .issue(Place::attribute_or_node(object, only), text)
                    .level(mild)
                    .stands(map, object);
            }
            _ => {}
        }
    }
}

/// Checks whether repeats or shapes can provide the sizes that the object does not have.
fn is_completed(object: Node<'_>) -> bool {
    ["repeat", "outlines", "outline", "skeleton"]
        .into_iter()
        .any(|part| object.child(part).is_some())
}

/// Reports an object with a radius and sides. In many files a size of zero means "none".
fn both<'a>(
    map: &RoadMap<'a>,
    object: Node<'a>,
    sides: &[&str],
    mild: Level,
    found: &mut Sink<'_>,
) {
    let is_zero = |name: &&str| number(object, name) == Some(0.0);
    let says_none = is_zero(&"radius") || sides.iter().all(is_zero);
    let text = format!(
        "{} has a `radius` as well as {}; its bounding volume must be either a cylinder or a box",
        named(object),
        listed(sides)
    );
    let place = Place::attribute_or_node(object, "radius");
    let older = object_parts::is_before(found, (1, 5));
    let finding = found.issue(place, text).stands(map, object);
    // Before 1.5 only the words of a table said that the two exclude each other, and tools wrote
    // both. A single side with a radius is not a box.
    if says_none {
        finding.level(mild);
    } else if older || (sides.len() < 2 && mild == Level::Information) {
        finding.level(Level::Warning);
    }
}
