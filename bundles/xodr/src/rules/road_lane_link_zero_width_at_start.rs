use crate::families::zero_width::{self, ZERO_WIDTH};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_link_zero_width_at_start",
    uids: &["asam.net:xodr:1.7.0:road.lane.link.zero_width_at_start"],
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    after: super::READABLE,
    params: &[ZERO_WIDTH],
    page: include_str!("road_lane_link_zero_width_at_start.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    zero_width::has_no_links(map, ContactPoint::Start, found);
}
