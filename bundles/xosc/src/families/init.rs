//! Effects of the private actions of `Init`.

use crate::families::triggers::canonical;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};

pub(crate) use qcbus_openscenario::{InitAction, init_actions as actions};

/// Checks whether an action has its effect at once, and ends.
pub(crate) fn is_instant(action: Element<'_, '_>) -> bool {
    let dynamics = match action.name() {
        "TeleportAction" | "VisibilityAction" | "AssignRouteAction" | "AcquirePositionAction" => {
            return true;
        }
        "SpeedAction" => "SpeedActionDynamics",
        "LaneChangeAction" => "LaneChangeActionDynamics",
        "LaneOffsetAction" => "LaneOffsetActionDynamics",
        _ => return false,
    };
    let relative = action.path(&["SpeedActionTarget", "RelativeTargetSpeed"]);
    let goes_on =
        |one: Element<'_, '_>| one.has("continuous") && one.flag("continuous") != Some(false);
    let shape = action
        .child(dynamics)
        .and_then(|it| it.word("dynamicsShape"));
    shape.as_deref() == Some("step") && !goes_on(action) && !relative.is_some_and(goes_on)
}

/// Checks whether an action starts from the present state of an entity, as in "one lane to the
/// left of its lane".
pub(crate) fn adds_to(action: Element<'_, '_>, entity: &str) -> bool {
    let mut within = action.descendants();
    within.any(|one| one.text("entityRef").is_some_and(|name| name == entity))
}

/// Checks whether two actions say the same.
pub(crate) fn are_same(one: Element<'_, '_>, other: Element<'_, '_>) -> bool {
    canonical(one) == canonical(other)
}

/// Returns the entities to which `Init` gives an absolute speed at once.
pub(crate) fn speeds_at_start(scenario: &Scenario<'_>) -> HashSet<String> {
    let mut found = HashSet::new();
    for one in actions(scenario) {
        let target = one
            .action
            .path(&["SpeedActionTarget", "AbsoluteTargetSpeed"]);
        if target.is_some() && is_instant(one.action) {
            found.extend(one.entities);
        }
    }
    found
}
