use crate::families::object_parts::{Stands, owner, polylines};
use crate::families::vertices::Vertices;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[SINCE_NINE, IN_EIGHT],
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

const SINCE_NINE: &str =
    "asam.net:xodr:1.9.0:road.object.skeleton.vertex_local.no_mixing_road_local";
const IN_EIGHT: &str = "asam.net:xodr:1.8.0:road.object.skeleton.vertex_road.polyline_elements";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let is_new = found
        .version()
        .is_some_and(|version| version >= Version::new(1, 9));
    let uid = if is_new { SINCE_NINE } else { IN_EIGHT };
    for polyline in polylines(map) {
        let vertices = Vertices::of(polyline);
        let (Some(road), Some(local)) = (vertices.road.first(), vertices.local.first()) else {
            continue;
        };
        let text = format!(
            "the polyline mixes {} `vertexRoad` with {} `vertexLocal`; all of its vertices must be of the same \
             kind",
            vertices.road.len(),
            vertices.local.len()
        );
        found
            .issue(polyline, text)
            .stands(map, owner(polyline))
            .uid(uid)
            .at(*road, "the first `vertexRoad`")
            .at(*local, "the first `vertexLocal`");
    }
}
