use crate::families::crg::{self, records};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
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
