use crate::families::triggers::called;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for group in scenario.elements("ManeuverGroup") {
        let Some(block) = group.child("Actors") else {
            continue;
        };
        let selects = block.flag("selectTriggeringEntities") == Some(true);
        let named = Actors::of(block).is_none_or(|actors| !actors.named.is_empty());
        if !selects || named || triggered_by_entities(group) != Some(false) {
            continue;
        }
        let text = format!(
            "the actors of {} are the entities that trigger it, but no start trigger of its act or of its events \
             has a `ByEntityCondition`; no entity acts",
            called(group)
        );
        found.about(block, "selectTriggeringEntities", text);
    }
}

/// Checks whether the start trigger of the act or of an event has a condition about entities.
/// Returns `None` if a maneuver is unknown, or there is none.
fn triggered_by_entities(group: Element<'_, '_>) -> Option<bool> {
    let by_entity = |owner: Element<'_, '_>| {
        owner.child("StartTrigger").is_some_and(|trigger| {
            trigger
                .descendants_named("ByEntityCondition")
                .next()
                .is_some()
        })
    };
    let mut maneuvers: Vec<Element<'_, '_>> = group.children_named("Maneuver").collect();
    for reference in group.children_named("CatalogReference") {
        maneuvers.push(group.scenario().entry(reference)?);
    }
    if maneuvers.is_empty() {
        return None;
    }
    let events = maneuvers
        .into_iter()
        .flat_map(|maneuver| maneuver.descendants_named("Event"));
    Some(group.parent().is_some_and(by_entity) || events.into_iter().any(by_entity))
}
