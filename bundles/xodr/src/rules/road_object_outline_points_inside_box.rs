use crate::families::object_frame::{TOLERANCE, report_outside};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    report_outside(
        map.part(part),
        |frame, object| {
            object
                .outlines()
                .flat_map(|outline| frame.corners(&outline))
                .collect()
        },
        "the outline",
        found,
    );
}
