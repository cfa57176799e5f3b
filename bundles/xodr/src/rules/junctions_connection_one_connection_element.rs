use crate::families::connections::{repeated, report_repeated};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..1.8.0",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        for (id, connections) in repeated(junction, |connection| connection.connecting_road()) {
            let text = format!(
                "the connecting road `{id}` occurs in {} connections of junction `{}`; OpenDRIVE 1.7 allows it \
                 only in one",
                connections.len(),
                junction.id()
            );
            report_repeated(map, text, &connections, found);
        }
    }
}
