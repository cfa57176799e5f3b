use crate::families::object_parts::{Stands, below, listed, named};
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
    for node in below(map, "tunnel", "objects") {
        let kind = node.attr("type").map_or("", str::trim);
        if TYPES.contains(&kind) {
            continue;
        }
        let has = match kind {
            "" => "no `type`".to_owned(),
            kind => format!("the unknown type `{kind}`"),
        };
        let text = format!(
            "{} has {has}; its type must be one of {}",
            named(node),
            listed(&TYPES)
        );
        found
            .issue(Place::attribute_or_node(node, "type"), text)
            .stands(map, node);
    }
}
