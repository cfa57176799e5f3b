//! Touching points of linked lanes (OpenDRIVE 1.9, annex D.1.1).

use foldhash::HashSet;

use crate::queries::map::RoadMap;
use crate::types::contacts::{LaneEnd, LaneJoint, TouchingLanes};
use crate::types::frame::BorderPoint;
use crate::types::road::Road;
use crate::types::value::Side;

/// Maximum number of links of one lane end that are searched for the same statement. No real lane
/// has that many. With more links, a pair may be found twice.
const MOST_LINKS: usize = 64;

impl<'a> RoadMap<'a> {
    /// Returns every pair of linked lanes with edges that can be evaluated. Each pair occurs once,
    /// in document order of the statements. The result is cached.
    pub fn touching_lanes(&self) -> impl Iterator<Item = &TouchingLanes<'a>> {
        let roads = self.roads().iter();
        let by_lanes = roads.flat_map(|road| self.touching_by(road));
        by_lanes.chain(self.touching_by_junctions())
    }

    /// Returns the pairs that the lanes of one road state first.
    pub(crate) fn touching_by<'m>(&'m self, road: &'m Road<'a>) -> &'m [TouchingLanes<'a>] {
        road.touching.get_or_init(|| {
            let (mut from, mut seen) = (None, HashSet::default());
            let first = |joint: &&LaneJoint<'a>| {
                if from != Some(joint.from) {
                    from = Some(joint.from);
                    seen.clear();
                }
                let returned = joint.to < joint.from && self.says(joint.to, joint.from);
                seen.insert(joint.to) && !returned
            };
            let pairs = self.joints_of(road).iter().filter(first);
            pairs.filter_map(|joint| self.touching(joint)).collect()
        })
    }

    /// Returns the pairs that only junctions state.
    pub(crate) fn touching_by_junctions(&self) -> &[TouchingLanes<'a>] {
        self.caches.touching.get_or_init(|| {
            let mut seen = HashSet::default();
            let first = |joint: &&LaneJoint<'a>| {
                let (one, other) = (joint.from, joint.to);
                seen.insert((one.min(other), one.max(other)))
                    && !self.says(one, other)
                    && !self.says(other, one)
            };
            let pairs = self.junction_joints().iter().filter(first);
            pairs.filter_map(|joint| self.touching(joint)).collect()
        })
    }

    /// Checks whether a lane itself links to another one at an end.
    fn says(&self, from: LaneEnd, to: LaneEnd) -> bool {
        let road = self.roads().get(from.lane.road as usize);
        let joints = road.map_or(&[][..], |road| self.joints_of(road));
        debug_assert!(
            joints.is_sorted_by_key(|joint| joint.from),
            "lanes and their ends must be sorted"
        );
        let begin = joints.partition_point(|joint| joint.from < from);
        let own = joints.get(begin..).unwrap_or(&[]).iter();
        let mut own = own.take(MOST_LINKS).take_while(|joint| joint.from == from);
        own.any(|joint| joint.to == to)
    }

    fn touching(&self, joint: &LaneJoint<'a>) -> Option<TouchingLanes<'a>> {
        let [left, right] = self.left_and_right(joint.from)?;
        let [other_left, other_right] = self.left_and_right(joint.to)?;
        let (left, right) = if joint.is_reversed() {
            ([left, other_right], [right, other_left])
        } else {
            ([left, other_left], [right, other_right])
        };
        Some(TouchingLanes {
            joint: *joint,
            left,
            right,
        })
    }

    /// Returns the edges of a lane as seen along s of its own road.
    fn left_and_right(&self, at: LaneEnd) -> Option<[BorderPoint; 2]> {
        let lane = self.lane(at.lane)?;
        let [inner, outer] = lane.borders_at(at.end)?;
        match lane.side()? {
            Side::Left => Some([outer, inner]),
            Side::Right => Some([inner, outer]),
        }
    }
}
