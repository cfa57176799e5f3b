use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.7.0:junctions.type_direct_no_conn_road",
        "asam.net:xodr:1.7.0:junctions.direct.connecting_road_attribute_usage",
        "asam.net:xodr:1.9.0:junctions.connection.no_connecting_road_direct",
    ],
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Direct) {
            continue;
        }
        if let Some(connecting) = connection.node().attribute("connectingRoad") {
            let text = format!(
                "a connection of the direct junction `{}` has connectingRoad = `{}`; direct junctions have no \
                 connecting roads; use `linkedRoad`",
                junction.id(),
                connecting.value()
            );
            found.issue(connecting, text);
        }
    }
}
