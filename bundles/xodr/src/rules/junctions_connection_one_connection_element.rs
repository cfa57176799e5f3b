use crate::families::connections::{repeated, report_repeated};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_connection_one_connection_element",
    uids: &["asam.net:xodr:1.7.0:junctions.connection.one_connection_element"],
    versions: "1.7.0..1.8.0",
    after: super::READABLE,
    page: include_str!("junctions_connection_one_connection_element.md"),
    run,
    ..Rule::DEFAULTS
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
