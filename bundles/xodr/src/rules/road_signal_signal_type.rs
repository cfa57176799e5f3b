use crate::families::object_parts::{Stands, below, is_blank, listed, named, owner};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let signs = below(map, "sign", "staticBoard");
    for node in below(map, "signal", "signals").chain(signs) {
        let missing: Vec<&str> = ["type", "subtype"]
            .into_iter()
            .filter(|name| is_blank(node, name))
            .collect();
        if missing.is_empty() {
            continue;
        }
        let text = format!(
            "{}: {} missing or empty; it must have a specific type and subtype (or `-1` if there is none)",
            named(node),
            match missing.as_slice() {
                [one] => format!("`{one}` is"),
                both => format!("{} are", listed(both)),
            }
        );
        let finding = found
            .issue(node, text)
            .stands(map, owner(node))
            .fault("signals without type");
        // Without any type it is not a sign. Some tools write an empty type for their own objects.
        if node.is("signal") && node.attribute("type").is_none() {
            finding.in_every_version(Level::Error);
        }
    }
}
