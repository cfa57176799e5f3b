use std::collections::HashMap;

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut surfaces: HashMap<&str, Node<'_>> = HashMap::new();
    for junction in map.junctions() {
        let mut records = junction
            .node()
            .children_named("surface")
            .flat_map(|surface| surface.child("CRG"));
        if let Some(own) = records.next() {
            surfaces.entry(junction.id()).or_insert(own);
        }
    }
    if surfaces.is_empty() {
        return;
    }
    for road in map.roads() {
        let own = road.junction().and_then(|id| Some((id, surfaces.get(id)?)));
        let (Some((id, own)), Some(record)) = (own, road.crgs().next()) else {
            continue;
        };
        let text = format!(
            "road `{}` has a CRG surface, but its junction `{id}` has one as well; only one of them may have a \
             CRG surface",
            road.id()
        );
        found
            .issue(record.node(), text)
            .at(*own, "the surface of the junction");
    }
}
