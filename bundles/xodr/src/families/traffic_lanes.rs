//! Lanes in which vehicles travel, for rules about sizes that suit vehicles.

use qcbus_opendrive::LaneRef;

/// Whether vehicles travel in the lane. Narrower than the list of annex D.1, which also has borders and
/// shoulders that are driven on now and then: those have any width and any shape.
pub(crate) fn is_for_traffic(lane: LaneRef<'_, '_>) -> bool {
    matches!(
        lane.kind(),
        Some(
            "driving"
                | "bidirectional"
                | "bus"
                | "taxi"
                | "HOV"
                | "entry"
                | "exit"
                | "onRamp"
                | "offRamp"
                | "connectingRamp"
                | "slipLane"
                | "mwyEntry"
                | "mwyExit"
        )
    )
}
