use crate::families::object_parts::check_types;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_tunnels_type_definition",
    uids: &["asam.net:xodr:1.7.0:road.object.tunnels.type_definition"],
    versions: "1.7.0..",
    after: super::READABLE,
    page: include_str!("road_object_tunnels_type_definition.md"),
    run,
    ..Rule::DEFAULTS
};

/// The types in the standard.
const TYPES: [&str; 2] = ["standard", "underpass"];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    check_types(map, "tunnel", &TYPES, found);
}
