//! Classification of lanes as drivable.

use super::routes::is_route;
use crate::prelude::*;

/// Checks whether vehicles drive on a lane according to annex D.1, deprecated types included. These
/// are the lanes of routes and the lanes on which vehicles drive occasionally.
pub(crate) fn is_drivable(lane: LaneRef<'_, '_>) -> bool {
    match lane.kind() {
        // A biking lane is drivable only if bicycles share it with other traffic.
        Some("biking") => lane.advisory().is_some_and(|advisory| advisory != "none"),
        Some("border" | "stop" | "restricted") => true,
        _ => is_route(lane),
    }
}
