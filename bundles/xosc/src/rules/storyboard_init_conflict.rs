use crate::families::init::{self, InitAction};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// A state of an entity that `Init` sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Sets {
    Place,
    Speed,
    Lateral,
    Route,
    Visibility,
}

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let actions = init::actions(scenario);
    let mut last: HashMap<(&str, Sets), &InitAction<'_, '_>> = HashMap::new();
    for later in &actions {
        let mut said = false;
        for entity in &later.entities {
            for set in sets(later.action) {
                let before = last.insert((entity.as_str(), *set), later);
                // An entity may override the value of its selection.
                let before = before.filter(|before| before.named == later.named && !said);
                if let Some(before) = before {
                    said = report(*set, before.action, later.action, entity, found);
                }
            }
        }
    }
}

/// Returns the states that an action sets.
fn sets(action: Element<'_, '_>) -> &'static [Sets] {
    match action.name() {
        "TeleportAction" => &[Sets::Place],
        "SpeedAction"
        | "SpeedProfileAction"
        | "LongitudinalDistanceAction"
        | "SynchronizeAction" => &[Sets::Speed],
        "LaneChangeAction" | "LaneOffsetAction" | "LateralDistanceAction" => &[Sets::Lateral],
        "AssignRouteAction" | "AcquirePositionAction" => &[Sets::Route],
        // An action with a set of sensors is about these sensors.
        "VisibilityAction" if action.children().next().is_none() => &[Sets::Visibility],
        "FollowTrajectoryAction" if action.path(&["TimeReference", "Timing"]).is_some() => {
            &[Sets::Lateral, Sets::Speed]
        }
        "FollowTrajectoryAction" => &[Sets::Lateral],
        _ => &[],
    }
}

fn report(
    set: Sets,
    before: Element<'_, '_>,
    later: Element<'_, '_>,
    entity: &str,
    found: &mut Sink<'_>,
) -> bool {
    let is_same_kind = before.name() == later.name();
    let at_once = (init::is_instant(before), init::is_instant(later));
    let is_sound = match at_once {
        // The first one sets the state from which the other one starts.
        (true, false) => true,
        // The lane and the offset in it are different things.
        (true, true) if set == Sets::Lateral && !is_same_kind => true,
        (true, true) => init::adds_to(later, entity),
        (false, _) => false,
    };
    if is_sound || (is_same_kind && init::are_same(before, later)) {
        return false;
    }
    let what = match set {
        Sets::Place => "place",
        Sets::Speed => "speed",
        Sets::Lateral => "lateral motion",
        Sets::Route => "route",
        Sets::Visibility => "visibility",
    };
    let text = if is_same_kind {
        format!(
            "`Init` has two actions `{}` for the {what} of `{entity}`; only one of them takes effect; remove the other one",
            later.name()
        )
    } else {
        format!(
            "`Init` sets the {what} of `{entity}` by `{}` and by `{}` at the same time; they conflict, and only one of \
             them takes effect; remove one, or start it later by an event",
            before.name(),
            later.name()
        )
    };
    // An offset keeps the entity in its lane, and some simulators add it to other actions.
    let with_offset = before.is("LaneOffsetAction") || later.is("LaneOffsetAction");
    // Some simulators drive a trajectory with the speed of another action.
    let in_doubt = with_offset
        || at_once == (false, true)
        || (matches!(set, Sets::Route | Sets::Speed) && !is_same_kind);
    let finding = found
        .about(later, "", text)
        .at(before.node(), "the action before it");
    if in_doubt {
        finding.level(Level::Information);
    }
    true
}
