use crate::families::object_parts::named;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.7.0:road.railroad.platforms.min_amount",
        "asam.net:xodr:1.7.0:road.railroad.stations.one_platform_per_station",
    ],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for station in map.stations() {
        if station.platforms().next().is_none() {
            let text = format!(
                "{} has no `platform`, but must have at least one",
                named(station.node())
            );
            found.issue(station.node(), text);
        }
    }
}
