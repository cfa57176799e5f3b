use crate::families::object_frame::{TOLERANCE, report_outside};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    report_outside(
        map.part(part),
        |frame, object| {
            object
                .polylines()
                .flat_map(|line| frame.vertices(&line, true))
                .collect()
        },
        "the skeleton (even without the width of its ends)",
        found,
    );
}
