use crate::families::corner_ids;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_corner_road_first_id_zero",
    uids: &["asam.net:xodr:1.9.0:road.corner_road.first_id_zero"],
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_corner_road_first_id_zero.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    corner_ids::first_is_zero(map, "cornerRoad", found);
}
