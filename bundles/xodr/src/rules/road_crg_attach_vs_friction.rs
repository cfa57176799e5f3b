use crate::families::crg::{purpose, records};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_crg_attach_vs_friction",
    uids: &["asam.net:xodr:1.7.0:road.crg.attach_vs_friction"],
    versions: "1.7.0..",
    after: super::READABLE,
    page: include_str!("road_crg_attach_vs_friction.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for record in records(map) {
        if record.attr("mode") == Some("attached") && purpose(record) == "friction" {
            let text = "the CRG record has the mode `attached` and the purpose `friction`; friction cannot be \
                        added to an existing value, so the mode must be a different one";
            found.issue(Place::attribute_or_node(record, "mode"), text);
        }
    }
}
