use crate::families::casts::Casts;
use crate::families::placement;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Actions that need an entity other than their actor. A lane or a single change of speed relative
/// to the actor itself is common and well defined. Another rule checks synchronisation.
const ACTIONS: &[(&str, &str, &str)] = &[
    (
        "LongitudinalDistanceAction",
        "entityRef",
        "keep a distance to itself",
    ),
    (
        "LateralDistanceAction",
        "entityRef",
        "keep a distance to itself",
    ),
];

/// Conditions about two entities, and their constant result if both are the same.
const CONDITIONS: &[(&str, &str)] = &[
    (
        "RelativeDistanceCondition",
        "its distance to itself is always 0",
    ),
    (
        "RelativeSpeedCondition",
        "its speed relative to itself is always 0",
    ),
    ("RelativeAngleCondition", "its angle to itself is always 0"),
    ("TimeHeadwayCondition", "it has no headway to itself"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut casts = Casts::default();
    for (action, attribute, what) in ACTIONS {
        for action in scenario.elements_everywhere(action) {
            actor(action, attribute, what, &mut casts, found);
        }
    }
    for target in scenario.elements_everywhere("RelativeTargetSpeed") {
        if target.flag("continuous") == Some(true) {
            actor(
                target,
                "entityRef",
                "keep its speed relative to itself forever",
                &mut casts,
                found,
            );
        }
    }
    for (condition, always) in CONDITIONS {
        for condition in scenario.elements_everywhere(condition) {
            triggering(condition, always, found);
        }
    }
    for reference in scenario.elements_everywhere("EntityRef") {
        match reference.node().parent().map(|parent| parent.name()) {
            Some("CollisionCondition") => {
                triggering(reference, "it cannot collide with itself", found);
            }
            Some("TimeToCollisionConditionTarget") => {
                triggering(reference, "it cannot collide with itself", found);
            }
            _ => {}
        }
    }
    first_positions(scenario, found);
}

fn actor<'m, 'd>(
    action: Element<'m, 'd>,
    attribute: &str,
    what: &str,
    casts: &mut Casts<'m, 'd>,
    found: &mut Sink<'_>,
) {
    let (Some(name), Some(cast)) = (action.text(attribute), casts.of(action)) else {
        return;
    };
    if let Some(actor) = cast.by_name.get(&*name)
        && action.scenario().entities().contains(&name)
    {
        let text = format!(
            "the action makes the actor {} {what}",
            quoted(action, attribute, &name)
        );
        found
            .about(action, attribute, text)
            .at(actor.node(), "the actor");
    }
}

fn triggering(condition: Element<'_, '_>, always: &str, found: &mut Sink<'_>) {
    let Some(name) = condition.text("entityRef") else {
        return;
    };
    let around = condition.ancestor("ByEntityCondition");
    let Some(entities) = around.and_then(|around| around.child("TriggeringEntities")) else {
        return;
    };
    // With several entities, each one may be the partner of another one. The reference is then only
    // superfluous.
    let mut names = entities
        .children_named("EntityRef")
        .map(|one| one.text("entityRef"));
    if let (Some(Some(only)), None) = (names.next(), names.next())
        && only == name
        && condition.scenario().entities().contains(&name)
    {
        let text = format!(
            "the condition compares {} with itself; {always}",
            quoted(condition, "entityRef", &name)
        );
        found
            .about(condition, "entityRef", text)
            .at(entities.node(), "the triggering entities");
    }
}

/// Reports an entity that is placed relative to itself before it has a place.
fn first_positions(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut seen: foldhash::HashSet<String> = foldhash::HashSet::default();
    for start in placement::starts(scenario) {
        let is_first = seen.insert(start.name.clone());
        let own = start
            .position
            .text("entityRef")
            .is_some_and(|name| name == *start.name);
        if is_first && own && start.position.name().starts_with("Relative") {
            let text = format!(
                "`{}` is placed relative to itself before it has a position",
                start.name
            );
            found.about(start.position, "entityRef", text);
        }
    }
}
