use crate::families::triggers::called;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for group in scenario.elements("ManeuverGroup") {
        // The schema reports a missing `Actors`.
        let Some(block) = group.child("Actors") else {
            continue;
        };
        let actors = Actors::of(block);
        if actors.is_none_or(|actors| actors.triggering || !actors.named.is_empty()) {
            continue;
        }
        let Some(private) = private_actions(group).next() else {
            continue;
        };
        let text = format!(
            "{} has private actions but no actors, so the actions affect no entity; `Actors` must have an \
             `EntityRef` or `selectTriggeringEntities=\"true\"`",
            called(group)
        );
        found
            .about(group, "", text)
            .at(block.node(), "its actors")
            .at(private.node(), "its first private action");
    }
}

/// Returns the private actions of a group, including those in maneuvers of catalogs.
fn private_actions<'m, 'd>(group: Element<'m, 'd>) -> impl Iterator<Item = Element<'m, 'd>> {
    let scenario = group.scenario();
    let entries = group
        .children_named("CatalogReference")
        .filter_map(|reference| scenario.entry(reference));
    group
        .children_named("Maneuver")
        .chain(entries)
        .flat_map(|maneuver| maneuver.descendants_named("PrivateAction"))
}
