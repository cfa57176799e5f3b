use crate::families::object_parts::{Stands, below, named, number, objects};
use crate::prelude::*;

const SLENDER: Param = Param::number(
    "slender",
    60.0,
    "m",
    "largest plausible size of poles, lamps, trees and the like, and largest plausible height of barriers and \
     the like",
);
const LARGE: Param = Param::number(
    "large",
    1000.0,
    "m",
    "largest plausible size of a building, and largest plausible height of any object",
);
const SIGNAL: Param = Param::number(
    "signal",
    50.0,
    "m",
    "largest plausible width and height of a signal",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[SLENDER, LARGE, SIGNAL],
    run,
    ..Rule::after(READABLE)
};

/// Types of objects that are slender in every relevant direction.
const SLENDER_TYPES: [&str; 6] = [
    "pole",
    "tree",
    "streetLamp",
    "trafficLight",
    "trafficSign",
    "patch",
];
/// Types of objects beside roads that may be kilometres long but are low.
const LOW_TYPES: [&str; 8] = [
    "barrier",
    "vegetation",
    "obstacle",
    "parkingSpace",
    "trafficIsland",
    "railing",
    "soundBarrier",
    "crosswalk",
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let (slender, large) = (found.number(&SLENDER), found.number(&LARGE));
    for object in objects(map) {
        let kind = object.attr("type").unwrap_or_default();
        let is = |kinds: &[&str]| kinds.iter().any(|known| known.eq_ignore_ascii_case(kind));
        let [ground, height] = match kind {
            _ if is(&SLENDER_TYPES) => [Some(slender), Some(slender)],
            _ if is(&LOW_TYPES) => [None, Some(slender)],
            "building" => [Some(large), Some(large)],
            _ => [None, Some(large)],
        };
        // Elevated roads, tunnels and the like may have any length.
        let limits = [
            ("height", height),
            ("radius", ground),
            ("length", ground),
            ("width", ground),
        ];
        check(map, object, &limits, found);
    }
    let most = Some(found.number(&SIGNAL));
    for signal in below(map, "signal", "signals") {
        check(map, signal, &[("height", most), ("width", most)], found);
    }
}

/// Reports only the first size above its limit, because a wrong unit is one fault.
fn check<'a>(
    map: &RoadMap<'a>,
    node: Node<'a>,
    limits: &[(&'static str, Option<f64>)],
    found: &mut Sink<'_>,
) {
    let mut beyond = limits.iter().filter_map(|(name, limit)| {
        let size = number(node, name)?;
        (*limit)
            .filter(|limit| size > *limit)
            .map(|limit| (*name, size, limit))
    });
    let Some((name, size, limit)) = beyond.next() else {
        return;
    };
    let of = match node.attr("type").filter(|_| node.is("object")) {
        Some(kind) if !kind.is_empty() => format!("{} of type `{kind}`", named(node)),
        _ => named(node),
    };
    let text = format!(
        "`{name}` of {of} is {size} m; more than {limit} m is implausible; sizes are in metres"
    );
    found
        .issue(Place::attribute_or_node(node, name), text)
        .stands(map, node);
}
