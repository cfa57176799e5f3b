//! Roads that lead into a junction and do not say so: the roads of the junction name them, they name none of it.

use std::collections::BTreeMap;

use foldhash::HashSet;
use qcbus_opendrive::{ContactPoint, JunctionType, Road, RoadContact, RoadEnd, RoadMap};

use super::mouths;

/// Roads whose mouths lie less than this apart, in metres, lie at one place.
const THERE: f64 = 1.0;

/// Ends of incoming roads that are linked to nothing or to another junction, with the links of the connecting roads
/// that begin or end there.
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

    /// The ends in document order.
    pub fn iter(&self) -> impl Iterator<Item = (RoadEnd, &[RoadContact<'a>])> {
        self.0.iter().map(|(end, links)| (*end, links.as_slice()))
    }

    pub fn contains(&self, end: RoadEnd) -> bool {
        self.0.contains_key(&end)
    }
}

/// Whether a road that a connecting road names lies there, but is linked to nothing or to another junction. One that is
/// linked to a road may go on there as well.
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
