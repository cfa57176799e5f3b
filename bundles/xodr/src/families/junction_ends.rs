//! Road ends that meet at a junction, and the pairs that the junction connects.

use std::collections::{BTreeMap, BTreeSet};

use crate::prelude::*;

/// The pairs of road ends that a junction connects, in either order.
pub(crate) struct Meeting {
    pairs: BTreeSet<(RoadEnd, RoadEnd)>,
}

impl Meeting {
    /// Reads the connections of a common or direct junction. Returns `None` if one of them cannot
    /// be followed from the incoming road to the road on the other side. Then the purpose of the
    /// junction is unknown.
    pub fn of<'a>(map: &RoadMap<'a>, junction: &Junction<'a>) -> Option<Meeting> {
        let mut pairs = BTreeSet::new();
        for connection in junction.connections() {
            let contact = map.connection_contact(junction, connection)?;
            let far = match junction.kind()? {
                JunctionType::Direct => contact.to,
                _ => beyond(map, junction, contact.to)?,
            };
            let (one, other) = (contact.from, far);
            pairs.insert(if one <= other {
                (one, other)
            } else {
                (other, one)
            });
        }
        Some(Meeting { pairs })
    }

    /// Returns the pairs without repetition.
    pub fn pairs(&self) -> impl Iterator<Item = (RoadEnd, RoadEnd)> {
        self.pairs.iter().copied()
    }

    /// Returns each road end with the road ends to which it is connected.
    pub fn partners(&self) -> BTreeMap<RoadEnd, BTreeSet<RoadEnd>> {
        let mut partners: BTreeMap<RoadEnd, BTreeSet<RoadEnd>> = BTreeMap::new();
        for (one, other) in self.pairs() {
            partners.entry(one).or_default().insert(other);
            partners.entry(other).or_default().insert(one);
        }
        partners
    }
}

/// Returns the road end to which a connecting road leads from `entry`. Returns `None` if it has no
/// link there or the link stays within the junction.
fn beyond(map: &RoadMap<'_>, junction: &Junction<'_>, entry: RoadEnd) -> Option<RoadEnd> {
    let connecting = map.road_at(entry.road)?;
    let far = map.linked_end(connecting, entry.end.other())?.to;
    let stays = map.road_at(far.road)?.junction() == Some(junction.id());
    (!stays).then_some(far)
}

/// Returns a road end as text: `road 5 (start)`, with the id in backticks.
pub(crate) fn name(map: &RoadMap<'_>, end: RoadEnd) -> String {
    let id = map.road_at(end.road).map_or("?", |road| road.id());
    format!("road `{id}` ({})", end.end)
}
