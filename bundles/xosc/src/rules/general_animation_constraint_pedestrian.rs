use crate::families::actions::acting;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for animation in scenario.elements_everywhere("PedestrianAnimation") {
        // Only the simulator knows the kind of an external object.
        let other = acting(animation)
            .unwrap_or_default()
            .into_iter()
            .find(|entity| matches!(entity.kind(), EntityKind::Vehicle | EntityKind::MiscObject));
        let Some(entity) = other else { continue };
        let text = format!(
            "`{}` is a `{}`, but only a pedestrian can perform a `PedestrianAnimation`",
            entity.name(),
            entity.kind().element()
        );
        found.about(animation, "", text).at(
            entity.element(scenario).node(),
            "the entity that must perform it",
        );
    }
}
