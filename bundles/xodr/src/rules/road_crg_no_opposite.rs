use crate::families::crg::records;
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_crg_no_opposite",
    uids: &["asam.net:xodr:1.7.0:road.crg.no_opposite"],
    versions: "1.7.0..",
    after: super::READABLE,
    page: include_str!("road_crg_no_opposite.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for record in records(map) {
        let Some(mode @ ("genuine" | "global")) = record.attr("mode") else {
            continue;
        };
        if record.attr("orientation") == Some("opposite") {
            let text = format!(
                "the CRG record has the orientation `opposite` in the mode `{mode}`; only the modes `attached` \
                 and `attached0` allow this orientation"
            );
            found.issue(Place::attribute_or_node(record, "orientation"), text);
        }
    }
}
