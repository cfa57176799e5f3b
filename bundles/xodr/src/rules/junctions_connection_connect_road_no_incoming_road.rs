use crate::families::faults::OfFault as _;
use std::collections::BTreeSet;

use crate::families::on_road::OnRoad;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.4.0..",
    backport: Backport::Alike { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        // The main road of a virtual junction passes through it and is also an incoming road.
        if junction.kind() == Some(JunctionType::Virtual) {
            continue;
        }
        let paths: BTreeSet<&str> = junction
            .connections()
            .filter_map(|connection| connection.connecting_road())
            .collect();
        for connection in junction.connections() {
            let incoming = connection.incoming_road().and_then(|id| map.road(id));
            let Some(road) = incoming.filter(|_| !connection.is_virtual()) else {
                continue;
            };
            let belongs = match road.junction() {
                Some(id) => format!("belongs to junction `{id}`"),
                None if paths.contains(road.id()) => {
                    format!("is a connecting road of junction `{}`", junction.id())
                }
                None => continue,
            };
            let text = format!(
                "the incoming road `{}` {belongs}; connecting roads must not be incoming roads",
                road.id()
            );
            let middle = road.length().unwrap_or(0.0) / 2.0;
            found
                .issue(
                    Place::attribute_or_node(connection.node(), "incomingRoad"),
                    text,
                )
                .on(road, middle, 0.0)
                .at(road.node(), "the connecting road")
                .of_junction(junction.node());
        }
    }
}
