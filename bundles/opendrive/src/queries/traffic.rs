//! Direction of traffic on a lane (OpenDRIVE 1.9, 11.3.1).

use crate::queries::lane_ref::LaneRef;
use crate::types::road::TrafficRule;
use crate::types::value::{ContactPoint, Side};

/// The directions in which traffic may run on a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Traffic {
    /// Towards this end of the lane section only.
    Towards(ContactPoint),
    /// In both directions, in changing ones, or unknown.
    Any,
}

/// Lane types without traffic in a single direction.
const UNDIRECTED: &[&str] = &[
    "bidirectional",
    "border",
    "curb",
    "median",
    "none",
    "parking",
    "shoulder",
    "sidewalk",
    "special1",
    "special2",
    "special3",
    "walking",
];

impl Traffic {
    /// Returns the traffic on a lane from the road's `@rule`, the lane's side, type and
    /// `@direction`.
    pub fn of(lane: LaneRef<'_, '_>) -> Traffic {
        let undirected = lane.kind().is_none_or(|kind| UNDIRECTED.contains(&kind));
        let (Some(side), Some(rule)) = (lane.side(), lane.at.road.traffic_rule()) else {
            return Traffic::Any;
        };
        if undirected || lane.dynamic_direction() == Some(true) {
            return Traffic::Any;
        }
        let along = (side == Side::Right) == (rule == TrafficRule::RightHand);
        match lane.direction() {
            None | Some("standard") => Traffic::Towards(end(along)),
            Some("reversed") => Traffic::Towards(end(!along)),
            Some(_) => Traffic::Any,
        }
    }

    /// Checks whether traffic may run towards this end.
    pub fn may_run_towards(self, end: ContactPoint) -> bool {
        self == Traffic::Any || self == Traffic::Towards(end)
    }
}

fn end(along: bool) -> ContactPoint {
    if along {
        ContactPoint::End
    } else {
        ContactPoint::Start
    }
}
