use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.5.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        let kind = match junction.kind() {
            None | Some(JunctionType::Virtual) => continue,
            Some(kind) => kind,
        };
        if connection.is_virtual() {
            let text = format!(
                "connection `{}` of junction `{}` is virtual, but the junction is of type `{}`; virtual \
                 connections must only be defined in virtual junctions",
                connection.id().unwrap_or_default(),
                junction.id(),
                kind.as_str()
            );
            found.issue(Place::attribute_or_node(connection.node(), "type"), text);
        }
    }
}
