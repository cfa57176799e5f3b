use std::collections::BTreeSet;

use crate::families::link_sides::{Known, agrees, in_virtual_junction};
use crate::families::routes::{is_route, lanes_at};
use crate::families::unlinked_arms::UnlinkedArms;
use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    direct_junctions(map, found);
    let known = Known::by(map);
    // `junctions.incoming_road_linked` reports these roads.
    let unlinked = UnlinkedArms::of(map);
    let mut told = BTreeSet::new();
    for road in map.roads() {
        for end in ContactPoint::BOTH {
            let Some(link) = road.link(end) else { continue };
            let at = RoadEnd::of(road, end);
            let linked = map.linked_end(road, end).map(|contact| contact.to);
            if unlinked.contains(at) || linked.is_some_and(|to| unlinked.contains(to)) {
                continue;
            }
            if let Some(id) = link.junction_id() {
                to_junction(map, (road, end), link, (id, &known), found);
            } else if let Some(id) = link.road_id() {
                let contact = link.contact_point().filter(|_| link.element_s().is_none());
                let Some(contact) = contact else { continue };
                to_road(map, (road, end), link, (id, contact), &mut told, found);
            }
        }
    }
}

/// Checks that roads in a direct junction link back to it. At common junctions the connecting roads
/// lead to the surrounding roads.
fn direct_junctions(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Direct) {
            continue;
        }
        let names = |road: &Road<'_>, end: ContactPoint| {
            road.link(end).and_then(|link| link.junction_id()) == Some(junction.id())
        };
        let incoming = connection.incoming_road().and_then(|id| map.road(id));
        if let Some(road) = incoming
            && !ContactPoint::BOTH.iter().any(|end| names(road, *end))
        {
            let text = format!(
                "road `{}` is an incoming road of direct junction `{}`, but neither its predecessor nor its \
                 successor is that junction; the link must be defined on both sides",
                road.id(),
                junction.id()
            );
            found
                .issue(
                    Place::attribute_or_node(connection.node(), "incomingRoad"),
                    text,
                )
                .at(road.node(), "the road")
                .follows(fault_of(junction.node()));
        }
        let linked = connection.linked_road().and_then(|id| map.road(id));
        if let Some((road, end)) = linked.zip(connection.contact_point())
            && !names(road, end)
        {
            let text = format!(
                "direct junction `{}` links to the {end} of road `{}`, but the {} of that road is not the junction; \
                 the link must be defined on both sides",
                junction.id(),
                road.id(),
                end.link_name()
            );
            found
                .issue(
                    Place::attribute_or_node(connection.node(), "linkedRoad"),
                    text,
                )
                .at(road.node(), "the road")
                .follows(fault_of(junction.node()));
        }
    }
}

fn to_road(
    map: &RoadMap<'_>,
    (road, end): (&Road<'_>, ContactPoint),
    link: RoadLink<'_>,
    (id, contact): (&str, ContactPoint),
    told: &mut BTreeSet<(usize, usize)>,
    found: &mut Sink<'_>,
) {
    let Some(other) = map.road(id) else { return };
    if other.index() == road.index() && contact == end {
        let text = format!(
            "the {} of road `{id}` is its own {end}; an end of a road cannot be linked to itself",
            end.link_name()
        );
        found.issue(link.node(), text);
        return;
    }
    let mut namesakes = map.roads_with_id(id);
    if in_virtual_junction(map, road)
        || namesakes.any(|other| agrees(map, (road, end), (other, contact)))
    {
        return;
    }
    let pair = (
        road.index().min(other.index()),
        road.index().max(other.index()),
    );
    if !told.insert(pair) {
        return;
    }
    let (mine, its) = (end.link_name(), contact.link_name());
    let (place, but) = match other.link(contact) {
        None => (other.node(), format!("road `{id}` has no {its}")),
        Some(back) => (
            back.node(),
            format!("the {its} of road `{id}` is {}", target(back)),
        ),
    };
    let expected = match road.junction() {
        Some(junction) => format!("junction `{junction}`"),
        None => format!("road `{}` ({end})", road.id()),
    };
    let text = format!(
        "the {mine} of road `{}` is road `{id}` ({contact}), but {but}; both sides must agree, so the link back \
         must lead to {expected}",
        road.id()
    );
    found.issue(link.node(), text).at(place, "the other side");
}

fn target(link: RoadLink<'_>) -> String {
    let id = link.element_id().unwrap_or_default();
    match (link.element_type(), link.contact_point()) {
        (Some("junction"), _) => format!("junction `{id}`"),
        (_, Some(contact)) => format!("road `{id}` ({contact})"),
        _ => format!("road `{id}`"),
    }
}

fn to_junction<'a>(
    map: &RoadMap<'a>,
    (road, end): (&Road<'a>, ContactPoint),
    link: RoadLink<'a>,
    (id, known): (&str, &Known<'a>),
    found: &mut Sink<'_>,
) {
    let mut junctions = map.junctions_with_id(id).peekable();
    if junctions.peek().is_none() || road.junction() == Some(id) {
        return;
    }
    if junctions.any(|junction| known.contains(junction, road, end)) {
        return;
    }
    let text = format!(
        "the {} of road `{}` is junction `{id}`, but the junction has no connection from or to this road; the link \
         must be defined on both sides",
        end.link_name(),
        road.id()
    );
    let place = map.junction(id).map(Junction::node);
    let mut finding = found.issue(link.node(), text);
    if let Some(place) = place {
        finding = finding.at(place, "the junction").follows(fault_of(place));
    }
    // A connecting road leads to a road. A route that comes to another junction here has no way on.
    let connects = map
        .junction_of(road)
        .is_some_and(|own| own.kind() == Some(JunctionType::Common));
    if connects && lanes_at(road, end).any(is_route) {
        finding.in_every_version(Level::Error);
    }
}
