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
        let has_both = carrier.fixed.is_some() && carrier.variable.is_some();
        let dynamic = carrier.node.attr("dynamic").map(str::trim);
        if !(has_both || carrier.is_called("multiBoard"))
            || matches!(dynamic, Some("yes" | "true" | "1"))
        {
            continue;
        }
        let has = dynamic.map_or("no `dynamic`".to_owned(), |value| {
            format!("`dynamic=\"{value}\"`")
        });
        let text = format!(
            "{} is a multi board with {has}; multi boards must be dynamic (`yes`)",
            named(carrier.node)
        );
        found
            .issue(Place::attribute_or_node(carrier.node, "dynamic"), text)
            .stands(map, carrier.node);
    }
}
