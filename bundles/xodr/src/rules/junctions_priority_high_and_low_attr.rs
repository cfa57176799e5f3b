use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    backport: Backport::Lower { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        for priority in junction.priorities() {
            let node = priority.node();
            let named = |road: Option<&str>| road.is_some_and(|id| !id.trim().is_empty());
            for (name, road) in [("high", priority.high()), ("low", priority.low())] {
                if !named(road) {
                    let text = format!(
                        "the `priority` does not say which road has {name} priority; it must have both `high` \
                         and `low`"
                    );
                    found
                        .issue(Place::attribute_or_node(node, name), text)
                        .fault(fault_of(node));
                }
            }
            if named(priority.high()) && priority.high() == priority.low() {
                let text = format!(
                    "road `{}` has both high and low priority in this record; `high` and `low` must be two \
                     different roads",
                    priority.high().unwrap_or_default()
                );
                found.issue(Place::attribute_or_node(node, "low"), text);
            }
        }
    }
}
