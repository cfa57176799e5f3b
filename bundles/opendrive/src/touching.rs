//! Where linked lanes touch: their touching points (OpenDRIVE 1.9, annex D.1.1).

use foldhash::HashSet;

use crate::joints::{LaneEnd, LaneJoint};
use crate::map::RoadMap;
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

impl<'a> RoadMap<'a> {
    /// Every pair of linked lanes whose edges can be evaluated, once, in document order of the
    /// statements. Found once and kept.
    pub fn touching_lanes(&self) -> &[TouchingLanes<'a>] {
        self.caches.touching.get_or_init(|| {
            let joints = self.lane_joints();
            let mut seen = HashSet::with_capacity_and_hasher(
                joints.len(),
                foldhash::fast::RandomState::default(),
            );
            let first = |joint: &&LaneJoint<'a>| {
                let (one, other) = (joint.from, joint.to);
                seen.insert((one.min(other), one.max(other)))
            };
            let pairs = joints.iter().filter(first);
            pairs.filter_map(|joint| self.touching(joint)).collect()
        })
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
