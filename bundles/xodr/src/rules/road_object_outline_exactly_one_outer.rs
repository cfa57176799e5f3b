use crate::families::object_parts::{Stands, below, owner};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for list in below(map, "outlines", "object") {
        let all: Vec<Node<'_>> = list.children_named("outline").collect();
        let outer: Vec<Node<'_>> = all.iter().copied().filter(|node| is_outer(*node)).collect();
        if all.is_empty() || outer.len() == 1 {
            continue;
        }
        let text = format!(
            "{} of {} outlines are outer outlines (an outline without `outer` counts as one); exactly one must \
             be an outer outline",
            outer.len(),
            all.len()
        );
        let finding = found.issue(list, text).stands(map, owner(list));
        if let Some(second) = outer.get(1) {
            finding.at(*second, "the second outer outline");
        }
    }
}

fn is_outer(outline: Node<'_>) -> bool {
    !matches!(outline.attr("outer").map(str::trim), Some("false" | "0"))
}
