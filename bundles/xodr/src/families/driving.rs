//! Which way traffic runs on a lane (OpenDRIVE 1.9, 11.3.1), and which lanes are for driving.

use qcbus_opendrive::{ContactPoint, LaneRef, Side, TrafficRule};

/// The directions in which traffic may run on a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Traffic {
    /// Towards this end of the lane section only.
    Towards(ContactPoint),
    /// In both directions, in changing ones, or nobody can say.
    Any,
}

/// Lanes without traffic that runs in one direction.
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
    /// The traffic on a lane, by the road's `@rule`, the lane's side and its `@direction`.
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

    /// Whether traffic may run towards this end.
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

/// Whether a lane is one that vehicles drive on, as annex D.1 lists them, deprecated types included.
pub(crate) fn is_drivable(lane: LaneRef<'_, '_>) -> bool {
    match lane.kind() {
        // Only where bicycles share the lane with others.
        Some("biking") => lane.advisory().is_some_and(|advisory| advisory != "none"),
        Some(kind) => is_drivable_kind(kind),
        None => false,
    }
}

fn is_drivable_kind(kind: &str) -> bool {
    // A `match` tells words apart by their length first.
    matches!(
        kind,
        "driving"
            | "entry"
            | "exit"
            | "onRamp"
            | "offRamp"
            | "connectingRamp"
            | "slipLane"
            | "border"
            | "stop"
            | "restricted"
            | "HOV"
            | "bidirectional"
            | "bus"
            | "mwyEntry"
            | "mwyExit"
            | "roadWorks"
            | "taxi"
    )
}
