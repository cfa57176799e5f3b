use crate::families::gantries::gantry_of;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.8.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for group in map.vms_groups() {
        let boards = group.references().filter_map(|reference| {
            let signal = map.signals_with_id(reference.signal_id()?).next()?;
            Some((reference, gantry_of(map, &signal)?))
        });
        let boards: Vec<_> = boards.collect();
        let Some((first, gantry)) = boards.first() else {
            continue;
        };
        if let Some((odd, other)) = boards.iter().find(|(_, other)| other != gantry) {
            let text = format!(
                "signal `{}` of message sign group `{}` belongs to gantry `{other}`, but signal `{}` belongs to \
                 gantry `{gantry}`; all boards of a group must be on the same gantry",
                odd.signal_id().unwrap_or_default(),
                group.id().unwrap_or_default(),
                first.signal_id().unwrap_or_default()
            );
            found
                .issue(odd.node(), text)
                .at(first.node(), "the first board of the group");
        }
    }
}
