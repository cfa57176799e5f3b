use crate::families::crg::{self, records};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_crg_h_offset_only_genuine_global",
    uids: &["asam.net:xodr:1.9.0:road.crg.h_offset_only_genuine_global"],
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    after: super::READABLE,
    page: include_str!("road_crg_h_offset_only_genuine_global.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for record in records(map) {
        let Some(mode @ ("attached" | "attached0")) = record.attr("mode") else {
            continue;
        };
        let because = format!("the mode `{mode}`; it is allowed with `genuine` and `global` only");
        let attributes = [("hOffset", 0.0)];
        crg::must_not_have(
            record,
            &attributes,
            &because,
            None,
            Level::Information,
            found,
        );
    }
}
