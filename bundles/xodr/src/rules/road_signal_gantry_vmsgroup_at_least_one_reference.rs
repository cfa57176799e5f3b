use std::collections::BTreeSet;

use crate::families::gantries::gantry_of;
use crate::families::on_road::OnRoad;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.8.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut grouped = BTreeSet::new();
    for group in map.vms_groups() {
        let mut references = group.references().peekable();
        if references.peek().is_none() {
            let text = format!(
                "message sign group `{}` has no `vmsBoardReference`; it must have at least one",
                group.id().unwrap_or_default()
            );
            found.issue(group.node(), text);
        }
        grouped.extend(references.filter_map(|reference| reference.signal_id()));
    }
    for (road, signal) in map.signals() {
        let has_board = signal.vms_boards().next().is_some();
        let id = signal.id().filter(|id| has_board && !grouped.contains(id));
        let gantry = id.and_then(|id| Some((id, gantry_of(map, &signal)?)));
        if let Some((id, gantry)) = gantry {
            let text = format!(
                "no message sign group refers to signal `{id}` with a variable board on gantry `{gantry}`; the boards of a \
                 gantry must be in a group"
            );
            found.issue(signal.node(), text).on(
                road,
                signal.s().unwrap_or(0.0),
                signal.t().unwrap_or(0.0),
            );
        }
    }
}
