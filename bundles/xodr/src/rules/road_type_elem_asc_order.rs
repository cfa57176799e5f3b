use crate::families::ascending::{TOLERANCE, VOID, along_road};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        along_road(road.id()).check(road.node().children_named("type"), VOID, found);
    }
}
