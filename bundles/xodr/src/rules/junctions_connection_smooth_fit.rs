use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Backport, Rule, Sink};

use crate::families::touching::{GAP, KINK, STEP, Where, report_misfits};
use crate::model::Roads;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_connection_smooth_fit",
    uids: &["asam.net:xodr:1.9.0:junctions.connection.smooth_fit"],
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    params: &[GAP, KINK, STEP],
    page: include_str!("junctions_connection_smooth_fit.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    report_misfits(map, |at| matches!(at, Where::Connection { .. }), found);
}
