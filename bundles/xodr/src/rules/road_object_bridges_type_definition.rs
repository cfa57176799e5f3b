use crate::families::object_parts::check_types;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "readers build the road without the bridge",
    )),
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

/// The types in the standard.
const TYPES: [&str; 4] = ["concrete", "steel", "brick", "wood"];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    check_types(map, "bridge", &TYPES, found);
}
