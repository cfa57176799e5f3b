use crate::families::on_road::OnRoad;
use crate::families::routes::is_route;
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let named = named(map);
    for road in map.roads() {
        let Some(junction) = map.junction_of(road) else {
            continue;
        };
        let kind = junction.kind();
        let connects = matches!(kind, Some(JunctionType::Common | JunctionType::Virtual));
        // A junction without any connection has a more serious fault.
        if !connects || junction.connections().next().is_none() || named.contains(road.id()) {
            continue;
        }
        if is_link_of_a_chain(map, road) || !road.sections().any(|it| it.lanes().any(is_route)) {
            continue;
        }
        let text = format!(
            "road `{}` belongs to junction `{}`, but no connection of a junction names it, so no route uses it; \
             a connecting road should be the `connectingRoad` of a connection",
            road.id(),
            junction.id()
        );
        found
            .issue(road.node(), text)
            .on(road, road.length().unwrap_or(0.0) / 2.0, 0.0)
            .at(junction.node(), "the junction");
    }
}

/// Returns the ids of all roads that junctions mention: as connecting, incoming or crossed roads,
/// or as part of a boundary.
fn named<'a>(map: &RoadMap<'a>) -> HashSet<&'a str> {
    let mut named = HashSet::default();
    for junction in map.junctions() {
        for connection in junction.connections() {
            let roads = [connection.target_road(), connection.incoming_road()];
            named.extend(roads.into_iter().flatten());
        }
        let crossing = junction
            .cross_paths()
            .filter_map(|path| path.crossing_road());
        named.extend(crossing);
        named.extend(junction.road_sections().filter_map(|one| one.road_id()));
        let segments = junction.boundary().into_iter().flat_map(|it| it.segments());
        named.extend(segments.filter_map(|one| one.road_id()));
    }
    named
}

/// Checks whether a road is part of a chain, of which the connection only names the first road.
fn is_link_of_a_chain<'a>(map: &RoadMap<'a>, road: &Road<'a>) -> bool {
    let beside = |end| map.road_at(map.linked_end(road, end)?.to.road);
    let mut beside = ContactPoint::BOTH.into_iter().filter_map(beside);
    beside.any(|other| other.junction() == road.junction())
}
