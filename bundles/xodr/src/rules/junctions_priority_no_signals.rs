use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_priority_no_signals",
    uids: &["asam.net:xodr:1.7.0:junctions.priority.no_signals"],
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("junctions_priority_no_signals.md"),
    run,
    ..Rule::DEFAULTS
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
