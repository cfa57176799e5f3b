use std::collections::HashSet;

use crate::families::ids::{Class, Kind};
use crate::families::object_parts::named;
use crate::prelude::*;
use qcbus_opendrive::Control;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut signals: Option<HashSet<&str>> = None;
    for controller in map.controllers() {
        let node = controller.node();
        if controller.controls().next().is_none() {
            let text = format!(
                "{} has no `control`, but must control at least one signal",
                named(node)
            );
            found.issue(node, text);
            continue;
        }
        let known = signals.get_or_insert_with(|| {
            let all = Kind::of(Class::Signal).nodes(&node.document());
            all.into_iter()
                .filter_map(|signal| signal.attr("id"))
                .collect()
        });
        let names = |control: Control<'_>| control.signal_id().is_none_or(|id| known.contains(id));
        if !controller.controls().any(names) {
            let subject = match controller.controls().count() {
                1 => format!(
                    "the only signal that {} controls does not exist",
                    named(node)
                ),
                count => format!(
                    "none of the {count} signals that {} controls exists",
                    named(node)
                ),
            };
            let text = format!("{subject}; it must control at least one existing signal");
            found.issue(node, text);
        }
    }
}
