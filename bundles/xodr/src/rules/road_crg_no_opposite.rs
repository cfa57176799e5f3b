use crate::families::crg::records;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
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
