use crate::families::lane_ranges;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_object_tunnels_from_lower_equal_to",
    uids: &["asam.net:xodr:1.7.0:road.object.tunnels.from_lower_equal_to"],
    versions: "1.7.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("road_object_tunnels_from_lower_equal_to.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    lane_ranges::lower_comes_first(map, &["tunnel"], found);
}
