//! Where linked lanes touch: their touching points (OpenDRIVE 1.9, annex D.1.1).

use foldhash::HashSet;

use crate::joints::{LaneEnd, LaneJoint};
use crate::map::RoadMap;
use crate::road::Road;
use crate::surface::BorderPoint;
use crate::value::Side;

/// Two linked lanes with the ends of their edges, as somebody sees them who looks along s of the
/// road of `joint.from`.
#[derive(Debug, Clone, Copy)]
pub struct TouchingLanes<'a> {
    /// The statement that they touch; of two that say the same the first.
    pub joint: LaneJoint<'a>,
    /// The left edge: of the lane of `joint.from`, and of that of `joint.to`.
    pub left: [BorderPoint; 2],
    /// The right edge.
    pub right: [BorderPoint; 2],
}

impl TouchingLanes<'_> {
    /// Both edges, the left one first.
    pub fn edges(&self) -> [[BorderPoint; 2]; 2] {
        [self.left, self.right]
    }

    /// The width of the narrower lane where they touch, in metres.
    pub fn narrower(&self) -> f64 {
        let width = |side: usize| (self.left[side].t - self.right[side].t).abs();
        width(0).min(width(1))
    }
}

/// Links of one lane end that are looked through for one that says the same. No real lane has as
/// many; of one that has, a pair may be found twice.
const MOST_LINKS: usize = 64;

impl<'a> RoadMap<'a> {
    /// Every pair of linked lanes whose edges can be evaluated, once, in document order of the
    /// statements. Found once and kept.
    pub fn touching_lanes(&self) -> impl Iterator<Item = &TouchingLanes<'a>> {
        let roads = self.roads().iter();
        let by_lanes = roads.flat_map(|road| self.touching_by(road));
        by_lanes.chain(self.touching_by_junctions())
    }

    /// The pairs that lanes of one road name first.
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

    /// The pairs that only junctions name.
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

    /// Whether a lane itself names another one at an end.
    fn says(&self, from: LaneEnd, to: LaneEnd) -> bool {
        let road = self.roads().get(from.lane.road as usize);
        let joints = road.map_or(&[][..], |road| self.joints_of(road));
        debug_assert!(
            joints.is_sorted_by_key(|joint| joint.from),
            "lanes and their ends come in order"
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

    /// The edges of a lane as seen along s of its own road.
    fn left_and_right(&self, at: LaneEnd) -> Option<[BorderPoint; 2]> {
        let lane = self.lane(at.lane)?;
        let [inner, outer] = lane.borders_at(at.end)?;
        match lane.side()? {
            Side::Left => Some([outer, inner]),
            Side::Right => Some([inner, outer]),
        }
    }
}
