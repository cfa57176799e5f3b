//! Roads that lead into a junction without a link to it, although its roads refer to them.

use std::collections::BTreeMap;

use super::mouths;
use crate::prelude::*;
use foldhash::HashSet;

/// Distance of mouths in metres below which two roads lie at the same place.
const THERE: f64 = 1.0;

/// Ends of incoming roads without a link or with a link to another junction. Each end has the links
/// of the connecting roads that begin or end there.
pub(crate) struct UnlinkedArms<'a>(BTreeMap<RoadEnd, Vec<RoadContact<'a>>>);

impl<'a> UnlinkedArms<'a> {
    pub fn of(map: &RoadMap<'a>) -> UnlinkedArms<'a> {
        let incoming: HashSet<(usize, &str)> = map
            .connections()
            .filter_map(|(at, connection)| Some((at.index(), connection.incoming_road()?)))
            .collect();
        let mut ends: BTreeMap<RoadEnd, Vec<RoadContact<'a>>> = BTreeMap::new();
        for connecting in map.roads().iter().filter(|road| road.junction().is_some()) {
            let mut junctions = map.junctions_with_id(connecting.junction().unwrap_or_default());
            let (Some(junction), None) = (junctions.next(), junctions.next()) else {
                continue;
            };
            if junction.kind() != Some(JunctionType::Common) {
                continue;
            }
            let links = ContactPoint::BOTH.map(|end| map.linked_end(connecting, end));
            for contact in links.into_iter().flatten() {
                let Some(arm) = map.road_at(contact.to.road) else {
                    continue;
                };
                let comes_in = incoming.contains(&(junction.index(), arm.id()));
                let linked = map.ends_at(junction, arm).contains(&true);
                if comes_in && !linked && is_elsewhere(map, arm, &contact) {
                    ends.entry(contact.to).or_default().push(contact);
                }
            }
        }
        UnlinkedArms(ends)
    }

    /// Returns the ends in document order.
    pub fn iter(&self) -> impl Iterator<Item = (RoadEnd, &[RoadContact<'a>])> {
        self.0.iter().map(|(end, links)| (*end, links.as_slice()))
    }

    pub fn contains(&self, end: RoadEnd) -> bool {
        self.0.contains_key(&end)
    }
}

/// Checks whether a named road lies there with no link or a link to another junction. A road with a
/// link to a road is excluded, because it may continue there as well.
fn is_elsewhere(map: &RoadMap<'_>, arm: &Road<'_>, contact: &RoadContact<'_>) -> bool {
    let elsewhere = match arm.link(contact.to.end) {
        None => true,
        Some(link) => link
            .junction_id()
            .is_some_and(|id| map.junction(id).is_some()),
    };
    let alone = map.roads_with_id(arm.id()).nth(1).is_none();
    let there = || mouths::apart(map, contact.from, contact.to).is_some_and(|it| it < THERE);
    elsewhere && alone && arm.junction().is_none() && there()
}
