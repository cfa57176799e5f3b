use crate::families::crg::{purpose, records};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
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
