//! Which lanes are for driving.

use qcbus_opendrive::LaneRef;

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
