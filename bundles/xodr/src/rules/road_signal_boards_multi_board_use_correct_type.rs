use crate::families::boards::carriers;
use crate::families::object_parts::{Stands, named};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for carrier in carriers(map) {
        let (Some(fixed), Some(variable)) = (carrier.fixed, carrier.variable) else {
            continue;
        };
        if carrier.is_called("multiBoard") {
            continue;
        }
        let text = format!(
            "{} carries static and variable boards, but its type is `{}`; it must be `multiBoard`",
            named(carrier.node),
            carrier.node.attr("type").unwrap_or_default()
        );
        found
            .issue(Place::attribute_or_node(carrier.node, "type"), text)
            .stands(map, carrier.node)
            .at(fixed, "a static board")
            .at(variable, "a variable board");
    }
}
