use crate::families::faults::OfFault as _;
use std::collections::HashSet;

use crate::prelude::*;

/// UID for connecting roads, which the rule of the standard does not mention.
const CONNECTING: &str = "qcbus.dev:xodr:1.4.0:junctions.connecting_road_in_junction";

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.8.0:junctions.cross_path.correct_junction_id",
        CONNECTING,
    ],
    versions: "1.8.0..",
    backport: Backport::Lower { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told = HashSet::new();
    let identified = |junction: &&Junction<'_>| !junction.id().is_empty();
    for junction in map.junctions().iter().filter(identified) {
        if junction.id() == "-1" {
            named_none(junction, found);
            continue;
        }
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
            let outside = road.junction().is_none_or(|id| id.trim().is_empty());
            if outside && role == "connecting" {
                outside_junction(map, (road, junction), user, found);
                continue;
            }
            let belonging = match road.junction() {
                Some(other) if !outside => format!("names junction `{other}`"),
                _ => "names no junction".to_owned(),
            };
            let text = format!(
                "road `{}` is a {role} road of junction `{}`, but {belonging} as its own; `junction` must contain \
                 the id of the junction to which the road belongs",
                road.id(),
                junction.id()
            );
            let finding = found
                .issue(Place::attribute_or_node(road.node(), "junction"), text)
                .at(user, "the reference of the junction to the road")
                .of_junction(junction.node());
            if role == "connecting" {
                finding.uid(CONNECTING);
            }
        }
    }
}

/// Reports a junction whose id means that a road belongs to no junction.
fn named_none(junction: &Junction<'_>, found: &mut Sink<'_>) {
    let text = "the junction has the id `-1`, which says of a road that it belongs to no junction; it must have another \
                id, and so must `junction` of its roads";
    found
        .issue(Place::attribute_or_node(junction.node(), "id"), text)
        .in_every_version(Level::Error)
        .uid(CONNECTING);
}

/// Reports a connecting road that belongs to no junction. No version allows this: readers take it
/// for an ordinary road, which the connection cannot use.
fn outside_junction<'a>(
    map: &RoadMap<'a>,
    (road, junction): (&Road<'a>, &Junction<'a>),
    connection: Node<'a>,
    found: &mut Sink<'_>,
) {
    let (id, of) = (road.id(), junction.id());
    let (at_road, at_connection) = (
        Place::attribute_or_node(road.node(), "junction"),
        Place::attribute_or_node(connection, "connectingRoad"),
    );
    // A road that leads to the junction lies around it. Then the connection names the wrong road.
    let is_arm = map.ends_at(junction, road).contains(&true);
    let finding = if is_arm {
        let text = format!(
            "`connectingRoad` is road `{id}`, but this road only leads to junction `{of}` and does not belong to \
             it; the connection must name a road inside the junction, with `junction=\"{of}\"`"
        );
        found
            .issue(at_connection, text)
            .at(at_road, "the road around the junction")
    } else {
        let text = format!(
            "road `{id}` is a connecting road of junction `{of}`, but its `junction` is `{}`; it must be `{of}`, \
             otherwise readers take the road for one outside of junctions",
            road.node().attr("junction").unwrap_or_default()
        );
        found
            .issue(at_road, text)
            .at(at_connection, "the connection that uses the road")
    };
    finding
        .in_every_version(Level::Error)
        .uid(CONNECTING)
        .of_junction(junction.node());
}
