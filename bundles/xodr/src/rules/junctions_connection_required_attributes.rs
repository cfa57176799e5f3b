use crate::families::object_parts::listed;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        check(junction, connection, found);
    }
}

fn check(junction: &Junction<'_>, connection: Connection<'_>, found: &mut Sink<'_>) {
    let to = match junction.kind() {
        Some(JunctionType::Common) if !connection.is_virtual() => "connectingRoad",
        Some(JunctionType::Direct) => "linkedRoad",
        _ => return,
    };
    // If the connection has the other kind of road at the far side, another rule reports it.
    let has = |name: &str| connection.node().attribute(name).is_some();
    let other = has("connectingRoad") || has("linkedRoad");
    let wanted = ["incomingRoad", to, "contactPoint"];
    let missing: Vec<&str> = wanted
        .into_iter()
        .filter(|name| !(has(name) || *name == to && other))
        .collect();
    if !missing.is_empty() {
        let text = format!(
            "connection `{}` of junction `{}` has no {}, so the road ends that it joins are undefined",
            connection.id().unwrap_or_default(),
            junction.id(),
            listed(&missing)
        );
        found.issue(connection.node(), text);
    }
}
