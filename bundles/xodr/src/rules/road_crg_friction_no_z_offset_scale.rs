use crate::families::crg::{self, purpose, records};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_crg_friction_no_z_offset_scale",
    uids: &["asam.net:xodr:1.7.0:road.crg.friction_no_z_offset_scale"],
    versions: "1.7.0..",
    after: super::READABLE,
    page: include_str!("road_crg_friction_no_z_offset_scale.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for record in records(map).filter(|record| purpose(*record) == "friction") {
        let attributes = [("zOffset", 0.0), ("zScale", 1.0)];
        crg::must_not_have(
            record,
            &attributes,
            "the purpose `friction`",
            None,
            Level::Warning,
            found,
        );
    }
}
