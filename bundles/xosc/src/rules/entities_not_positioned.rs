use std::cell::LazyCell;

use crate::families::{placement, references};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_entities_not_positioned",
    uids: &["qcbus.dev:xosc:1.0.0:entities.not_positioned"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("entities_not_positioned.md"),
    run,
    ..Rule::DEFAULTS
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
