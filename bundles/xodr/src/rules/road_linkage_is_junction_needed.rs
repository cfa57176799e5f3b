use std::collections::BTreeMap;

use crate::families::on_road::{MAX_PLACES, OnRoad};
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.4.0..",
    backport: Backport::Alike { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // Another rule reports such a junction, and nothing is certain about its roads.
    if map.has_reserved_junction() {
        return;
    }
    // The links to each road end, from roads outside junctions.
    let mut named: BTreeMap<RoadEnd, Vec<(&str, Node<'_>)>> = BTreeMap::new();
    for road in map.roads().iter().filter(|road| road.junction().is_none()) {
        for contact in ContactPoint::BOTH
            .iter()
            .filter_map(|end| map.linked_end(road, *end))
        {
            named
                .entry(contact.to)
                .or_default()
                .push((road.id(), contact.node));
        }
    }
    for (end, links) in named {
        let [(_, first), rest @ ..] = links.as_slice() else {
            continue;
        };
        let Some(road) = map.road_at(end.road).filter(|_| !rest.is_empty()) else {
            continue;
        };
        let text = format!(
            "{} to the {} of road `{}`; only one road may be linked to an end directly, and several roads need a \
             junction",
            who(&links),
            end.end,
            road.id()
        );
        let mut finding = found.issue(*first, text).at_end(road, end.end);
        for (id, link) in rest.iter().take(MAX_PLACES) {
            finding = finding.at(*link, format!("the link of road `{id}`"));
        }
    }
}

/// Describes the roads with links there, each id once.
fn who(links: &[(&str, Node<'_>)]) -> String {
    let mut seen = HashSet::default();
    let ids = links.iter().filter(|(id, _)| seen.insert(*id));
    let mut ids: Vec<String> = ids.map(|(id, _)| format!("`{id}`")).collect();
    if let [id] = ids.as_slice() {
        return format!("{} links of roads with the id {id} lead", links.len());
    }
    if ids.len() > MAX_PLACES {
        let more = ids.len() - MAX_PLACES;
        ids.truncate(MAX_PLACES);
        ids.push(format!("and {more} more"));
    }
    format!("the roads {} are all linked", ids.join(", "))
}
