use crate::families::triggers::called;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for group in scenario.elements("ManeuverGroup") {
        let actor = group.path(&["Actors", "EntityRef"]);
        // A maneuver of a catalog may have private actions.
        let (Some(actor), None) = (actor, group.child("CatalogReference")) else {
            continue;
        };
        let mut actions = group
            .children_named("Maneuver")
            .flat_map(|maneuver| maneuver.descendants_named("Action"))
            .peekable();
        let only_global = actions.peek().is_some()
            && actions.all(|action| {
                action.child("GlobalAction").is_some() && action.child("PrivateAction").is_none()
            });
        if only_global {
            let text = format!(
                "{} has actors but only global actions, which no entity performs; `Actors` may be empty, or a \
                 private action may be intended",
                called(group)
            );
            found.about(actor, "", text);
        }
    }
}
