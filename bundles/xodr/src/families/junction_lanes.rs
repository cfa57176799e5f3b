//! Use of the surrounding lanes by junctions.

use super::routes::{is_route, lanes_at};
use crate::prelude::*;
use foldhash::HashSet;

/// Lanes around junctions that are used by a connection.
pub(crate) struct Used<'a> {
    /// The lane ends from or to which a lane of a junction leads.
    lanes: HashSet<LaneEnd>,
    /// Junctions and roads with all lanes in use, because a connection has no lane links.
    whole: HashSet<(usize, &'a str)>,
    /// Road ends at which lanes of connecting roads end without a link to a lane.
    open: HashSet<RoadEnd>,
}

impl<'a> Used<'a> {
    pub fn of(map: &RoadMap<'a>) -> Used<'a> {
        let mut used = Used {
            lanes: HashSet::default(),
            whole: HashSet::default(),
            open: HashSet::default(),
        };
        // Only lanes of roads outside junctions are looked up later.
        let roads = map.roads().iter();
        let outside: Vec<bool> = roads.map(|road| road.junction().is_none()).collect();
        let is_outside = |end: &LaneEnd| {
            let road = outside.get(end.lane.road as usize);
            road.copied().unwrap_or(false)
        };
        let joints = map.junction_joints().iter();
        let ends = joints.flat_map(|joint| [joint.from, joint.to]);
        used.lanes.extend(ends.filter(is_outside));
        for road in map.roads().iter().filter(|road| road.junction().is_some()) {
            let ends = map.joints_of(road).iter().map(|one| one.to);
            used.lanes.extend(ends.filter(is_outside));
            let open = ContactPoint::BOTH
                .into_iter()
                .filter(|end| is_open(road, *end));
            used.open
                .extend(open.filter_map(|end| Some(map.linked_end(road, end)?.to)));
        }
        for (junction, connection) in map.connections() {
            if connection.lane_links().next().is_none() {
                let roads = [connection.incoming_road(), connection.linked_road()];
                let roads = roads.into_iter().flatten();
                used.whole.extend(roads.map(|id| (junction.index(), id)));
            }
            if let Some(road) = connection.incoming_road().and_then(|id| map.road(id)) {
                used.take_up(map, (junction, road), connection);
            }
        }
        used
    }

    /// Adds the lanes in `from` of lane links. Another rule reports a target that does not exist.
    fn take_up(
        &mut self,
        map: &RoadMap<'a>,
        (junction, road): (&Junction<'a>, &Road<'a>),
        connection: Connection<'a>,
    ) {
        let target = connection.target_road().and_then(|id| map.road(id));
        let touches = map.ends_at(junction, road);
        // If both ends touch the junction, the target road determines which end is meant.
        if touches == [true, true] && target.is_some() {
            return;
        }
        let ends = ContactPoint::BOTH.into_iter().zip(touches);
        for (end, _) in ends.filter(|(_, touches)| *touches) {
            let at = RoadEnd::of(road, end);
            let named = connection.lane_links();
            self.lanes.extend(
                named.filter_map(|link| map.lane_at_road_end(at, link.from()?, link.from_layer())),
            );
        }
    }

    /// Checks whether a connection uses all lanes of a road or leads to all of them.
    pub fn is_whole(&self, junction: &Junction<'a>, road: &Road<'a>) -> bool {
        self.whole.contains(&(junction.index(), road.id()))
    }

    /// Checks whether it is unknown to which lanes of a road end the junction leads.
    pub fn is_open(&self, end: RoadEnd) -> bool {
        self.open.contains(&end)
    }

    pub fn contains(&self, lane: LaneRef<'_, '_>, end: ContactPoint) -> bool {
        let lane = lane.key();
        self.lanes.contains(&LaneEnd { lane, end })
    }
}

/// Checks whether a lane leads out of a connecting road at this end without a link to a lane.
fn is_open(road: &Road<'_>, end: ContactPoint) -> bool {
    let mut lanes = lanes_at(road, end).filter(|lane| is_route(*lane));
    lanes.any(|lane| Traffic::of(lane).may_run_towards(end) && lane.links(end).next().is_none())
}

/// Returns the ends of roads outside junctions that are linked to a common or direct junction.
pub(crate) fn arms<'m, 'a>(
    map: &'m RoadMap<'a>,
) -> impl Iterator<Item = (&'m Road<'a>, ContactPoint, &'m Junction<'a>)> {
    let roads = map.roads().iter();
    let roads = roads.filter(|road| road.junction().is_none());
    let ends = roads.flat_map(|road| ContactPoint::BOTH.map(|end| (road, end)));
    ends.filter_map(|(road, end)| {
        let junction = map.junction(road.link(end)?.junction_id()?)?;
        let kind = junction.kind();
        let cuts = matches!(kind, Some(JunctionType::Common | JunctionType::Direct));
        cuts.then_some((road, end, junction))
    })
}
