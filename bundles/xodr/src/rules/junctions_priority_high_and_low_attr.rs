use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_priority_high_and_low_attr",
    uids: &["asam.net:xodr:1.8.0:junctions.priority.high_and_low_attr"],
    versions: "1.8.0..",
    backport: Backport::Lower { since: "1.1.0" },
    after: super::READABLE,
    page: include_str!("junctions_priority_high_and_low_attr.md"),
    run,
    ..Rule::DEFAULTS
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
                    found.issue(Place::attribute_or_node(node, name), text);
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
