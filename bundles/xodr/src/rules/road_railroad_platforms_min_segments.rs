use crate::families::object_parts::named;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_railroad_platforms_min_segments",
    uids: &[
        "asam.net:xodr:1.7.0:road.railroad.platforms.min_segments",
        "asam.net:xodr:1.7.0:road.railroad.segment.segments_per_platform_min_amount",
    ],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_railroad_platforms_min_segments.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for platform in map.stations().flat_map(|station| station.platforms()) {
        if platform.segments().next().is_none() {
            let text = format!(
                "{} has no `segment`, but must have at least one",
                named(platform.node())
            );
            found.issue(platform.node(), text);
        }
    }
}
