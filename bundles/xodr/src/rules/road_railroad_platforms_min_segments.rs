use crate::families::object_parts::named;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.7.0:road.railroad.platforms.min_segments",
        "asam.net:xodr:1.7.0:road.railroad.segment.segments_per_platform_min_amount",
    ],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
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
