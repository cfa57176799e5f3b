use crate::families::faults::OfFault as _;
use std::collections::BTreeSet;

use crate::families::on_road::OnRoad;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let known = roads_of(junction);
        for segment in junction
            .boundary()
            .into_iter()
            .flat_map(|boundary| boundary.segments())
        {
            let road = segment
                .road_id()
                .filter(|id| !known.contains(id))
                .and_then(|id| map.road(id));
            if let Some(road) = road.filter(|road| !meets(road, junction)) {
                check(junction, road, segment, &known, found);
            }
        }
    }
}

/// Returns the roads in the connections and cross paths of the junction.
fn roads_of<'a>(junction: &Junction<'a>) -> BTreeSet<&'a str> {
    let connections = junction
        .connections()
        .flat_map(|one| [one.incoming_road(), one.connecting_road()]);
    let paths = junction.cross_paths().map(|path| path.crossing_road());
    connections.chain(paths).flatten().collect()
}

/// Checks whether a road is linked to the junction.
fn meets(road: &Road<'_>, junction: &Junction<'_>) -> bool {
    let link = |end| road.link(end).and_then(|link| link.junction_id());
    ContactPoint::BOTH
        .into_iter()
        .any(|end| link(end) == Some(junction.id()))
}

fn check(
    junction: &Junction<'_>,
    road: &Road<'_>,
    segment: BoundarySegment<'_>,
    known: &BTreeSet<&str>,
    found: &mut Sink<'_>,
) {
    let neighbours: Vec<&str> = ContactPoint::BOTH
        .into_iter()
        .filter_map(|end| road.link(end)?.road_id())
        .collect();
    let what = if road.junction() != Some(junction.id()) {
        format!(
            "has `junction=\"{}\"`; it must be the junction's id",
            road.node().attr("junction").unwrap_or("-1")
        )
    } else if !neighbours.iter().any(|id| known.contains(id)) {
        "is not linked to any road of the junction; it must be linked to the roads beside it"
            .to_owned()
    } else {
        return;
    };
    let text = format!(
        "road `{}` only serves to close the boundary of junction `{}`, but {what}",
        road.id(),
        junction.id()
    );
    found
        .issue(segment.node(), text)
        .at(road.node(), "the road")
        .at_end(road, ContactPoint::Start)
        .in_boundary_of(junction);
}
