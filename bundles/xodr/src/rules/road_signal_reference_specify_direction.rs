use crate::families::object_parts::{Stands, below, named};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for reference in below(map, "signalReference", "signals") {
        let orientation = reference.attr("orientation").map_or("", str::trim);
        if matches!(orientation, "+" | "-" | "none") {
            continue;
        }
        let has = match orientation {
            "" => "no `orientation`".to_owned(),
            other => format!("the unknown orientation `{other}`"),
        };
        let text = format!(
            "{} has {has}; it must define whether the signal is valid along the road (`+`), against it (`-`) or \
             in both directions (`none`)",
            named(reference)
        );
        found
            .issue(Place::attribute_or_node(reference, "orientation"), text)
            .stands(map, reference);
    }
}
