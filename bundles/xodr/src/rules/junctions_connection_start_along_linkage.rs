use crate::families::connections;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_connection_start_along_linkage",
    uids: &["asam.net:xodr:1.7.0:junctions.connection.start_along_linkage"],
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    after: super::READABLE,
    page: include_str!("junctions_connection_start_along_linkage.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    connections::contact_point_is_right(map, ContactPoint::Start, found);
}
