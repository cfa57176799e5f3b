//! Private actions of `Init`, in the order of the file.

use crate::families::triggers::canonical;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};

/// A private action of `Init` and the entity that it is for.
pub(crate) struct InitAction<'m, 'd> {
    /// Name in `Private`, of an entity or a selection.
    pub(crate) named: String,
    /// Names of the entities behind it.
    pub(crate) entities: Vec<String>,
    /// Element with the name of the action, such as `SpeedAction`.
    pub(crate) action: Element<'m, 'd>,
}

/// Returns the private actions of `Init`. Those of unknown entities are left out.
pub(crate) fn actions<'m, 'd>(scenario: &'m Scenario<'d>) -> Vec<InitAction<'m, 'd>> {
    let mut found = Vec::new();
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let privates = actions
        .into_iter()
        .flat_map(|actions| actions.children_named("Private"));
    for private in privates {
        let Some(named) = private.text("entityRef") else {
            continue;
        };
        let Some(entities) = scenario.entities().expand(&named) else {
            continue;
        };
        let names = entities.iter().map(|entity| entity.name().to_owned());
        let entities: Vec<String> = names.collect();
        for kind in private
            .children_named("PrivateAction")
            .flat_map(Element::children)
        {
            let Some(action) = inner(kind) else { continue };
            found.push(InitAction {
                named: named.clone().into_owned(),
                entities: entities.clone(),
                action,
            });
        }
    }
    found
}

/// Returns the action within its group.
fn inner<'m, 'd>(kind: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    match kind.name() {
        "LongitudinalAction" | "LateralAction" | "RoutingAction" => kind.children().next(),
        _ => Some(kind),
    }
}

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
