use crate::families::ascending::{TOLERANCE, along_road};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for layer in road.layers() {
            along_road(road.id()).check(
                layer.node().children_named("laneSection"),
                |_, _| None,
                found,
            );
        }
    }
}
