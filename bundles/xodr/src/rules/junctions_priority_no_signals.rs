use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let Some(priority) = junction.priorities().next() else {
            continue;
        };
        if let Some(controller) = junction.controllers().next() {
            let text = format!(
                "junction `{}` has `priority` records, but signals as well: controller `{}`; priorities should only be \
                 given where no signals regulate the traffic",
                junction.id(),
                controller.id().unwrap_or_default()
            );
            found
                .issue(priority.node(), text)
                .at(controller.node(), "the controller of its signals");
        }
    }
}
