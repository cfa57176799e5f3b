use crate::families::center_lane;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "readers ignore the width of the center lane",
    )),
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for element in ["width", "border"] {
        center_lane::has_no(
            map.part(part),
            element,
            "it is a line and has no extent",
            found,
        );
    }
}
