use std::collections::HashSet;

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    backport: Backport::Lower { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told = HashSet::new();
    let identified = |junction: &&Junction<'_>| !junction.id().is_empty();
    for junction in map.junctions().iter().filter(identified) {
        let paths = junction.cross_paths();
        let paths = paths.map(|path| (path.crossing_road(), path.node(), "crossing"));
        // Direct junctions and crossings have no own roads.
        let connects = matches!(
            junction.kind(),
            Some(JunctionType::Common | JunctionType::Virtual)
        );
        let connections = junction
            .connections()
            .filter(|connection| connects && !connection.is_virtual());
        let connections = connections.map(|one| (one.connecting_road(), one.node(), "connecting"));
        for (id, user, role) in connections.chain(paths) {
            let Some(road) = id.and_then(|id| map.road(id)) else {
                continue;
            };
            let mut namesakes = map.roads_with_id(road.id());
            let belongs = namesakes.any(|road| road.junction() == Some(junction.id()));
            if belongs || !told.insert((junction.index(), road.index())) {
                continue;
            }
            let belonging = match road.junction() {
                Some(other) => format!("names junction `{other}`"),
                None => "names no junction".to_owned(),
            };
            let text = format!(
                "road `{}` is a {role} road of junction `{}`, but {belonging} as its own; `junction` must contain \
                 the id of the junction to which the road belongs",
                road.id(),
                junction.id()
            );
            found
                .issue(Place::attribute_or_node(road.node(), "junction"), text)
                .at(user, "the reference of the junction to the road");
        }
    }
}
