use crate::families::connections;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_connection_end_opposite_linkage",
    uids: &["asam.net:xodr:1.7.0:junctions.connection.end_opposite_linkage"],
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    after: super::READABLE,
    page: include_str!("junctions_connection_end_opposite_linkage.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    connections::contact_point_is_right(map, ContactPoint::End, found);
}
