use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

/// A lane link with an overlap zone and the lanes that it links.
struct Overlap<'a> {
    zone: Node<'a>,
    connection: Node<'a>,
    lanes: [(Option<&'a str>, Option<i64>); 2],
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Direct) {
            continue;
        }
        let overlaps: Vec<Overlap<'_>> = junction.connections().flat_map(overlaps_of).collect();
        match overlaps.as_slice() {
            [] => {}
            [only] => {
                let text = "only this lane link of the junction has an `overlapZone`; the link of the lane that \
                            it overlaps must have one, too";
                found
                    .issue(Place::attribute_or_node(only.zone, "overlapZone"), text)
                    .level(Level::Warning);
            }
            [one, other] if share_a_lane(one, other) => {}
            [one, other] => {
                let text = "two lane links with an `overlapZone` have no lane in common; the pair must share \
                            its incoming or its target lane";
                found
                    .issue(Place::attribute_or_node(other.zone, "overlapZone"), text)
                    .at(one.zone, "the other lane link");
            }
            [one, other, further @ ..] => {
                let text = format!(
                    "{} lane links of direct junction `{}` have an `overlapZone`; only one pair may have it",
                    overlaps.len(),
                    junction.id()
                );
                let finding = found.issue(junction.node(), text);
                let finding = finding
                    .at(one.zone, "the first lane link")
                    .at(other.zone, "the second lane link");
                further.iter().fold(finding, |finding, link| {
                    finding.at(link.zone, "a further lane link")
                });
            }
        }
    }
}

fn overlaps_of(connection: Connection<'_>) -> impl Iterator<Item = Overlap<'_>> {
    let links = connection.lane_links();
    let links = links.filter(|link| link.node().attribute("overlapZone").is_some());
    links.map(move |link| Overlap {
        zone: link.node(),
        connection: connection.node(),
        lanes: [
            (connection.incoming_road(), link.from()),
            (connection.target_road(), link.to()),
        ],
    })
}

/// Checks whether two links of different connections start or end in the same lane.
fn share_a_lane(one: &Overlap<'_>, other: &Overlap<'_>) -> bool {
    one.connection != other.connection && one.lanes.iter().any(|lane| other.lanes.contains(lane))
}
