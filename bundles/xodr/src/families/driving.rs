//! Which lanes are for driving.

use qcbus_opendrive::LaneRef;

use super::routes::is_route;

/// Whether a lane is one that vehicles drive on, as annex D.1 lists them, deprecated types included: those along
/// which routes lead, and those that are driven on now and then.
pub(crate) fn is_drivable(lane: LaneRef<'_, '_>) -> bool {
    match lane.kind() {
        // Only where bicycles share the lane with others.
        Some("biking") => lane.advisory().is_some_and(|advisory| advisory != "none"),
        Some("border" | "stop" | "restricted") => true,
        _ => is_route(lane),
    }
}
