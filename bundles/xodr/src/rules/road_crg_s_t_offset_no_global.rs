use crate::families::crg::{self, records};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[ALONG, ACROSS],
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

const ALONG: &str = "asam.net:xodr:1.7.0:road.crg.s_t_offset_no_global";
/// UID of a requirement in the table of `CRG` without an identifier.
const ACROSS: &str = "qcbus.dev:xodr:1.9.0:road.crg.x_y_offset_only_global";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let knows_xy = found
        .version()
        .is_some_and(|version| version >= Version::new(1, 9));
    for record in records(map) {
        match record.attr("mode") {
            Some("global") => {
                let attributes = [("sOffset", 0.0), ("tOffset", 0.0)];
                let because = "the mode `global`";
                crg::must_not_have(
                    record,
                    &attributes,
                    because,
                    Some(ALONG),
                    Level::Information,
                    found,
                );
            }
            Some(mode @ ("attached" | "attached0" | "genuine")) if knows_xy => {
                let attributes = [("xOffset", 0.0), ("yOffset", 0.0)];
                let because = format!("the mode `{mode}`; it is allowed with `global` only");
                crg::must_not_have(
                    record,
                    &attributes,
                    &because,
                    Some(ACROSS),
                    Level::Information,
                    found,
                );
            }
            _ => {}
        }
    }
}
