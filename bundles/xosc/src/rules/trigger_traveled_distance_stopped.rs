use crate::families::actions::acting;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run<'d>(scenario: &Scenario<'d>, found: &mut Sink<'_>) {
    let mut conditions = scenario
        .elements_everywhere("TraveledDistanceCondition")
        .peekable();
    if conditions.peek().is_none() {
        return;
    }
    let Some(moved) = moved(scenario) else { return };
    for condition in conditions {
        let Some(by_entity) = condition.ancestor("ByEntityCondition") else {
            continue;
        };
        let Some(triggering) = by_entity.child("TriggeringEntities") else {
            continue;
        };
        let all = triggering.word("triggeringEntitiesRule").as_deref() == Some("all");
        let Some(entities) = entities(triggering) else {
            continue;
        };
        let still = |entity: &&&Entity<'d>| stays(scenario, entity, &moved);
        let stays: Vec<&&Entity<'d>> = entities.iter().filter(still).collect();
        let Some(entity) = stays.first() else {
            continue;
        };
        if !all && stays.len() < entities.len() {
            continue;
        }
        let text = format!(
            "`{}` must travel a distance, but nothing in this scenario moves it; it has no controller, and no \
             action gives it a speed or a path; unless the simulator drives it, the condition is never true",
            entity.name()
        );
        found.about(condition, "", text);
    }
}

/// Returns the entities that a condition is about. Returns `None` if one is unknown.
fn entities<'m, 'd>(triggering: Element<'m, 'd>) -> Option<Vec<&'m Entity<'d>>> {
    let known = triggering.scenario().entities();
    let mut entities = Vec::new();
    for reference in triggering.children_named("EntityRef") {
        entities.extend(known.expand(&reference.text("entityRef")?)?);
    }
    Some(entities)
}

/// Checks whether an entity is never moved.
fn stays<'d>(scenario: &Scenario<'d>, entity: &Entity<'d>, moved: &HashSet<String>) -> bool {
    let controlled = entity.element(scenario).child("ObjectController");
    let known = matches!(
        entity.kind(),
        EntityKind::Vehicle | EntityKind::Pedestrian | EntityKind::MiscObject
    );
    known
        && !moved.contains(entity.name())
        && controlled.is_none_or(|controller| controller.children().next().is_none())
}

/// Returns the names of the entities that any action moves. Returns `None` if one of them is
/// unknown.
fn moved(scenario: &Scenario<'_>) -> Option<HashSet<String>> {
    // Trailers move with their vehicle. A group with an unknown maneuver may do anything.
    let trailers = ["Trailer", "TrailerAction"];
    let towed = trailers
        .iter()
        .any(|name| scenario.elements_everywhere(name).next().is_some());
    if towed || !scenario.storyboard().is_complete() {
        return None;
    }
    let mut moved = HashSet::new();
    for action in scenario.elements_everywhere("PrivateAction") {
        // Catalogs that are checked by themselves have no actors.
        if moves(action) {
            let acting = acting(action)?;
            moved.extend(acting.into_iter().map(|entity| entity.name().to_owned()));
        }
    }
    Some(moved)
}

/// Checks whether an action may move an entity. Setting the speed to 0 does not.
fn moves(action: Element<'_, '_>) -> bool {
    action.children().any(|kind| match kind.name() {
        "VisibilityAction" | "AppearanceAction" | "TeleportAction" => false,
        _ => {
            let target = kind.path(&["SpeedAction", "SpeedActionTarget", "AbsoluteTargetSpeed"]);
            target.and_then(|target| target.number("value")) != Some(0.0)
        }
    })
}
