use crate::families::init::{self, InitAction};
use crate::families::motion::may_drive_itself;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let actions = init::actions(scenario);
    for (at, one) in actions.iter().enumerate() {
        let Some((target, reference)) = relative(one) else {
            continue;
        };
        // Another rule reports an entity that refers to itself, and one that is unknown.
        let entity = scenario.entities().object(&reference);
        let Some(entity) = entity.filter(|_| !one.entities.contains(&reference)) else {
            continue;
        };
        if may_drive_itself(scenario, entity) {
            continue;
        }
        let mut givers = actions
            .iter()
            .enumerate()
            .filter(|(_, other)| other.entities.contains(&reference) && gives_speed(other.action));
        match givers.next() {
            None => nowhere(scenario, target, &reference, found),
            Some((place, later)) if place > at => {
                let back = leads_back(&actions, later, &one.entities);
                let so = if back {
                    "relative to this one again; one of them needs a speed of its own"
                } else {
                    "only later in `Init`; at that moment it is still 0; move its `Private` before this one"
                };
                let text =
                    format!("this speed is relative to `{reference}`, whose own speed is set {so}");
                found
                    .about(target, "entityRef", text)
                    .at(later.action.node(), "the action that sets its speed");
            }
            Some(_) => {}
        }
    }
}

/// Returns the target of an action that sets a speed at once, relative to another entity, and the
/// name of that entity. A continuous target follows the other entity, so the order does not matter.
fn relative<'m, 'd>(one: &InitAction<'m, 'd>) -> Option<(Element<'m, 'd>, String)> {
    if !one.action.is("SpeedAction") || !init::is_instant(one.action) {
        return None;
    }
    let target = one
        .action
        .path(&["SpeedActionTarget", "RelativeTargetSpeed"])?;
    Some((target, target.text("entityRef")?.into_owned()))
}

/// Checks whether the speed of an action depends on one of the entities.
fn leads_back<'m, 'd>(
    actions: &[InitAction<'m, 'd>],
    from: &InitAction<'m, 'd>,
    entities: &[String],
) -> bool {
    let mut at = from;
    for _ in 0..actions.len() {
        let Some((_, reference)) = relative(at) else {
            return false;
        };
        if entities.contains(&reference) {
            return true;
        }
        let gives = |other: &&InitAction<'m, 'd>| {
            other.entities.contains(&reference) && gives_speed(other.action)
        };
        match actions.iter().find(gives) {
            Some(next) => at = next,
            None => return false,
        }
    }
    false
}

/// Checks whether an action may give its entity a speed.
fn gives_speed(action: Element<'_, '_>) -> bool {
    !matches!(
        action.name(),
        "TeleportAction"
            | "VisibilityAction"
            | "AppearanceAction"
            | "LaneChangeAction"
            | "LaneOffsetAction"
            | "LateralDistanceAction"
            | "AssignRouteAction"
    )
}

/// Reports a speed relative to an entity without speed.
fn nowhere(
    scenario: &Scenario<'_>,
    target: Element<'_, '_>,
    reference: &str,
    found: &mut Sink<'_>,
) {
    // A simulator's own action may do anything.
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let is_open =
        actions.is_none_or(|it| it.descendants_named("UserDefinedAction").next().is_some());
    if is_open {
        return;
    }
    let text = format!(
        "this speed is relative to `{reference}`, to which `Init` gives no speed; unless the simulator gives it one, \
         its speed is 0; set its speed first, or use `AbsoluteTargetSpeed`"
    );
    found
        .about(target, "entityRef", text)
        .level(Level::Information);
}
