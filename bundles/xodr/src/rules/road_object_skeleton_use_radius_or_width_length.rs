use crate::families::object_parts::{Stands, owner, polylines};
use crate::families::vertices::Vertices;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[ONE_WAY, ROAD, LOCAL],
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

const ONE_WAY: &str = "asam.net:xodr:1.8.0:road.object.skeleton.use_radius_or_width_length";
const ROAD: &str =
    "asam.net:xodr:1.8.0:road.object.skeleton.vertex_road.no_radius_with_width_length";
const LOCAL: &str = "asam.net:xodr:1.8.0:road.object.skeleton.vertex_local.vertex_local_elements";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for polyline in polylines(map) {
        let vertices = Vertices::of(polyline);
        let sort = match (vertices.road.as_slice(), vertices.local.as_slice()) {
            ([_, ..], []) => ROAD,
            ([], [_, ..]) => LOCAL,
            _ => ONE_WAY,
        };
        let all: Vec<Node<'_>> = vertices.road.into_iter().chain(vertices.local).collect();
        let first = |is: fn(Node<'_>) -> bool| all.iter().copied().find(|node| is(*node));
        let (uid, text, places) = match (first(is_round), first(is_box), first(is_bare)) {
            (Some(round), Some(boxy), _) => {
                let text = "the polyline defines the size of its vertices both by `radius` and by `width` or \
                            `length`; all vertices must use the same attributes";
                (sort, text, [round, boxy])
            }
            (Some(sized), None, Some(bare)) | (None, Some(sized), Some(bare)) => {
                let text = "some vertices of the polyline have a size and others do not; either all or none must have \
                     one";
                (ONE_WAY, text, [sized, bare])
            }
            _ => continue,
        };
        found
            .issue(polyline, text)
            .stands(map, owner(polyline))
            .uid(uid)
            .at(places[0], "one of them")
            .at(places[1], "the other");
    }
}

fn is_round(vertex: Node<'_>) -> bool {
    vertex.attr("radius").is_some()
}

fn is_box(vertex: Node<'_>) -> bool {
    vertex.attr("width").is_some() || vertex.attr("length").is_some()
}

fn is_bare(vertex: Node<'_>) -> bool {
    !is_round(vertex) && !is_box(vertex)
}
