use crate::families::object_parts::check_types;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

/// The types in the standard.
const TYPES: [&str; 2] = ["standard", "underpass"];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    check_types(map, "tunnel", &TYPES, found);
}
