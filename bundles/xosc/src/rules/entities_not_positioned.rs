use std::cell::LazyCell;

use crate::families::{placement, references};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario || scenario.root().child("Storyboard").is_none() {
        return;
    }
    let Some(placed) = placement::placed(scenario) else {
        return;
    };
    let dangling = LazyCell::new(|| references::dangling_entities(scenario));
    for entity in scenario.entities().objects() {
        let must_be = matches!(entity.kind(), EntityKind::Vehicle | EntityKind::Pedestrian);
        if must_be && !placed.contains(entity.name()) && !dangling.may_mean(entity.name()) {
            let text = format!(
                "nothing places the entity `{}`: it has no `TeleportAction`, no trajectory and no \
                 `AddEntityAction`; its start position depends on the simulator",
                entity.name()
            );
            found.about(entity.element(scenario), "name", text);
        }
    }
}
