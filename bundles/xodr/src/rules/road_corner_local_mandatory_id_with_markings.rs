use crate::families::corner_ids;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_corner_local_mandatory_id_with_markings",
    uids: &["asam.net:xodr:1.9.0:road.corner_local.mandatory_id_with_markings"],
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_corner_local_mandatory_id_with_markings.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    corner_ids::are_mandatory(map, "cornerLocal", found);
}
