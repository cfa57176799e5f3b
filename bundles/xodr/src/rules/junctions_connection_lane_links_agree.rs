use crate::families::connection_links::{Bundle, Entries, bundles};
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::{NARROW, is_route, is_wide, lanes_at, routes_at};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[NARROW],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for bundle in bundles(map) {
        for link in &bundle.links {
            contradicted(map, &bundle, *link, found);
        }
        left_out(map, &bundle, found);
    }
    let entries = Entries::of(map);
    for road in map.roads().iter().filter(|road| road.junction().is_some()) {
        for end in ContactPoint::BOTH {
            unconnected(map, (road, end), &entries, found);
        }
    }
}

/// Reports a lane link if the connecting lane links to another lane of the incoming road.
fn contradicted(
    map: &RoadMap<'_>,
    bundle: &Bundle<'_>,
    (from, to, node): (i64, i64, Node<'_>),
    found: &mut Sink<'_>,
) {
    let end = bundle.to.end;
    let lane = map
        .lane_at_road_end(bundle.to, to, LayerKind::Permanent)
        .and_then(|at| map.lane(at.lane));
    let Some(lane) = lane.filter(|_| from != 0) else {
        return;
    };
    let Some(first) = named(lane, end)
        .next()
        .filter(|_| named(lane, end).all(|own| own != from))
    else {
        return;
    };
    // Another rule reports a lane that does not exist, or the center lane.
    if map
        .lane_at_road_end(bundle.from, from, LayerKind::Permanent)
        .is_none()
    {
        return;
    }
    let incoming = map.road_at(bundle.from.road).map_or("", |road| road.id());
    let text = format!(
        "the lane link leads from lane `{from}` of road `{incoming}` to {}, but that lane names lane `{first}` as its \
         {}; both must name the same lane",
        lane_name(lane),
        end.link_name()
    );
    let place = lane
        .links(end)
        .next()
        .map_or(lane.node(), |link| link.node());
    found
        .issue(node, text)
        .at_lane_end(lane, end)
        .at(place, "the link of the lane");
}

/// Reports a connecting lane with a link to an incoming lane but without a lane link.
fn left_out(map: &RoadMap<'_>, bundle: &Bundle<'_>, found: &mut Sink<'_>) {
    let end = bundle.to.end;
    let (Some(road), Some(incoming)) = (map.road_at(bundle.to.road), map.road_at(bundle.from.road))
    else {
        return;
    };
    // If a lane link leads to a lane that does not exist, it is probably the missing one.
    let exists = |(_, id, _): &(i64, i64, Node<'_>)| {
        let lane = map.lane_at_road_end(bundle.to, *id, LayerKind::Permanent);
        *id != 0 && lane.is_some()
    };
    for lane in lanes_at(road, end) {
        let id = lane.id().unwrap_or(0);
        if bundle.links.iter().any(|(_, to, _)| *to == id)
            || !is_route(lane)
            || Traffic::of(lane) != Traffic::Towards(end.other())
            || !is_wide(lane, end, found.number(&NARROW))
        {
            continue;
        }
        if !bundle.links.iter().all(exists) {
            return;
        }
        // Without lane links, lanes with the same number are linked.
        let by_number = bundle.links.is_empty();
        let Some(from) = named(lane, end).find(|from| !(by_number && *from == id)) else {
            continue;
        };
        let without = if by_number {
            "has no lane links, so only lanes of the same number are linked"
        } else {
            "has no lane link for it"
        };
        let text = format!(
            "{} continues lane `{from}` of road `{}`, but the connection between them {without}; traffic cannot \
             turn there without a lane link",
            lane_name(lane),
            incoming.id()
        );
        found
            .issue(bundle.connection.node(), text)
            .level(Level::Warning)
            .at_lane_end(lane, end)
            .at(lane.node(), "the lane");
    }
}

/// Reports a connecting road with lanes in both directions but connections in only one.
fn unconnected<'a>(
    map: &RoadMap<'a>,
    (road, end): (&Road<'a>, ContactPoint),
    entries: &Entries<'a>,
    found: &mut Sink<'_>,
) {
    let Some((incoming, at)) = entries.missing(map, road, end) else {
        return;
    };
    let from = RoadEnd::of(incoming, at);
    let comes_in = |id: &i64| {
        let lane = map.lane_at_road_end(from, *id, LayerKind::Permanent);
        let lane = lane.and_then(|at| map.lane(at.lane));
        lane.is_some_and(|lane| Traffic::of(lane) == Traffic::Towards(at))
    };
    let mut lanes = routes_at(road, end, found.number(&NARROW)).filter_map(|lane| {
        let along = Traffic::of(lane) == Traffic::Towards(end.other());
        let linked = lane.id().is_none_or(|id| entries.leads_to(road, id));
        let from = named(lane, end).find(comes_in);
        Some((lane, from.filter(|_| along && !linked)?))
    });
    let Some((lane, from)) = lanes.next() else {
        return;
    };
    let text = format!(
        "{} continues lane `{from}` of road `{}`, but no connection leads from road `{}` onto road `{}` (its \
         connections begin only at the other end); traffic cannot turn there without a connection",
        lane_name(lane),
        incoming.id(),
        incoming.id(),
        road.id()
    );
    found
        .issue(lane.node(), text)
        .level(Level::Warning)
        .at_lane_end(lane, end)
        .at(incoming.node(), "the road that it continues");
}

/// Returns the permanent lanes to which a lane is linked at an end.
fn named<'a>(lane: LaneRef<'_, 'a>, end: ContactPoint) -> impl Iterator<Item = i64> + use<'a> {
    let links = lane.links(end);
    links
        .filter(|link| link.layer() == LayerKind::Permanent)
        .filter_map(|link| link.id())
}
