use crate::families::center_lane;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    center_lane::has_no(
        map.part(part),
        "access",
        "it carries no traffic; access rules belong to the lanes beside it",
        found,
    );
}
