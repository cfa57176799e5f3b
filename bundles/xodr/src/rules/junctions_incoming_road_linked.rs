use crate::families::on_road::{MAX_PLACES, OnRoad};
use crate::families::unlinked_arms::UnlinkedArms;
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (arm, links) in UnlinkedArms::of(map).iter() {
        unlinked(map, arm, links, found);
    }
    one_of_several(map, found);
}

/// Reports a road that leads into a junction but has no link, or a link to another junction.
fn unlinked(map: &RoadMap<'_>, arm: RoadEnd, links: &[RoadContact<'_>], found: &mut Sink<'_>) {
    let first = links.first().and_then(|link| map.road_at(link.from.road));
    let (Some(road), Some(connecting)) = (map.road_at(arm.road), first) else {
        return;
    };
    let name = arm.end.link_name();
    let id = road.id();
    let (place, says) = match road.link(arm.end) {
        None => (road.node(), format!("road `{id}` has no {name}")),
        Some(link) => {
            let other = link.junction_id().unwrap_or_default();
            let says = format!("the {name} of road `{id}` is junction `{other}`");
            (link.node(), says)
        }
    };
    let junction = connecting.junction().unwrap_or_default();
    let text = format!(
        "{says}, but its {1} meets road `{0}` of junction `{junction}`; link it to junction `{junction}`, \
         otherwise its continuations cannot be found",
        connecting.id(),
        arm.end
    );
    let mut finding = found.issue(place, text).at_end(road, arm.end);
    for link in links.iter().take(MAX_PLACES) {
        let from = map.road_at(link.from.road).map_or("", |road| road.id());
        finding = finding.at(link.node, format!("the link of road `{from}`"));
    }
    finding.also_violates("asam.net:xodr:1.9.0:road.linkage.both_sides_consistency");
}

/// Reports a road that is linked to only one of several roads of a junction.
fn one_of_several(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // The first connecting road of each incoming road, and the roads that are already reported.
    let mut first = foldhash::HashMap::default();
    let mut told = HashSet::default();
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Common) || connection.is_virtual() {
            continue;
        }
        let incoming = connection.incoming_road().and_then(|id| map.road(id));
        let roads = incoming.zip(connection.connecting_road());
        let Some((road, connecting)) = roads.filter(|(road, _)| road.junction().is_none()) else {
            continue;
        };
        let key = (junction.index(), road.index());
        let is_choice = *first.entry(key).or_insert(connecting) != connecting;
        if !is_choice || map.ends_at(junction, road).contains(&true) || !told.insert(key) {
            continue;
        }
        if let Some((link, end)) = link_within(map, road, junction) {
            let text = format!(
                "the {} of road `{}` is road `{}`, one of several that continue it in junction `{}`; the road \
                 must be linked to the junction, otherwise the other continuations cannot be found",
                end.link_name(),
                road.id(),
                link.road_id().unwrap_or_default(),
                junction.id()
            );
            found
                .issue(link.node(), text)
                .at_end(road, end)
                .at(connection.node(), "another continuation");
        }
    }
}

/// Returns the link of a road that leads to a road within a junction.
fn link_within<'a>(
    map: &RoadMap<'a>,
    road: &Road<'a>,
    junction: &Junction<'a>,
) -> Option<(RoadLink<'a>, ContactPoint)> {
    let links = ContactPoint::BOTH.into_iter();
    let mut links = links.filter_map(|end| Some((road.link(end)?, end)));
    links.find(|(link, _)| {
        let linked = link.road_id().and_then(|id| map.road(id));
        linked.is_some_and(|linked| linked.junction() == Some(junction.id()))
    })
}
