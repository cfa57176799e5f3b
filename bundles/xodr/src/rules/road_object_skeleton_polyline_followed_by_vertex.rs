use crate::families::object_parts::{Stands, owner, polylines};
use crate::families::vertices::Vertices;
use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    uids: &[POLYLINE, ROAD, LOCAL],
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

const POLYLINE: &str = "asam.net:xodr:1.8.0:road.object.skeleton.polyline_followed_by_vertex";
const ROAD: &str = "asam.net:xodr:1.8.0:road.object.skeleton.vertex_road.element_min_amount";
const LOCAL: &str = "asam.net:xodr:1.8.0:road.object.skeleton.vertex_local.element_min_amount";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for polyline in polylines(map) {
        let vertices = Vertices::of(polyline);
        let (road, local) = (vertices.road.len(), vertices.local.len());
        let (uid, text) = match (road, local) {
            (1, 0) => (
                ROAD,
                "the polyline has 1 `vertexRoad`, but needs at least 2".to_owned(),
            ),
            (0, 1) => (
                LOCAL,
                "the polyline has 1 `vertexLocal`, but needs at least 2".to_owned(),
            ),
            (0 | 1, 0 | 1) => {
                let text = format!(
                    "the polyline has {road} `vertexRoad` and {local} `vertexLocal`; it needs at least 2 of the \
                     same kind"
                );
                (POLYLINE, text)
            }
            _ => continue,
        };
        found
            .issue(polyline, text)
            .stands(map, owner(polyline))
            .uid(uid)
            .fault(fault_of(polyline));
    }
}
