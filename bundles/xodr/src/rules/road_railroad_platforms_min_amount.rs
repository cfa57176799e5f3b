use crate::families::object_parts::named;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_railroad_platforms_min_amount",
    uids: &[
        "asam.net:xodr:1.7.0:road.railroad.platforms.min_amount",
        "asam.net:xodr:1.7.0:road.railroad.stations.one_platform_per_station",
    ],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_railroad_platforms_min_amount.md"),
    run,
    ..Rule::DEFAULTS
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
