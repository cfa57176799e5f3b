use qcbus_openscenario::{Actors, Element, Entity, EntityKind, Scenario};
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::references::quoted;
use crate::model::{About, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_general_references_to_scenario_object",
    uids: &[
        "asam.net:xosc:1.1.0:general.references_to_scenario_object",
        "asam.net:xosc:1.2.0:reference_control.references_to_scenario_object",
    ],
    level: Level::Warning,
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("general_references_to_scenario_object.md"),
    run,
    ..Rule::DEFAULTS
};

/// What vehicles and pedestrians do, after the standard's table of entity type constraints.
const OF_THE_LIVING: &[&str] = &[
    "ActivateControllerAction",
    "AssignControllerAction",
    "AssignRouteAction",
    "LateralDistanceAction",
    "LaneChangeAction",
    "LaneOffsetAction",
    "LongitudinalDistanceAction",
    "SpeedAction",
    "SpeedProfileAction",
    "SynchronizeAction",
];
/// What only vehicles do.
const OF_VEHICLES: &[&str] = &["OverrideControllerValueAction"];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in OF_THE_LIVING {
        for action in scenario.elements_everywhere(action) {
            let allowed = [EntityKind::Vehicle, EntityKind::Pedestrian];
            actors(action, &allowed, "vehicles and pedestrians", found);
        }
    }
    for action in OF_VEHICLES {
        for action in scenario.elements_everywhere(action) {
            actors(action, &[EntityKind::Vehicle], "vehicles", found);
        }
    }
    for action in scenario.elements_everywhere("SynchronizeAction") {
        master(action, found);
    }
}

fn actors(action: Element<'_, '_>, allowed: &[EntityKind], who: &str, found: &mut Sink<'_>) {
    let Some(actors) = Actors::of(action) else {
        return;
    };
    let entities = action.scenario().entities();
    for actor in &actors.named {
        let Some(name) = actor.text("entityRef") else {
            continue;
        };
        let Some(objects) = entities.expand(&name) else {
            continue;
        };
        let what = action.name();
        let Some(wrong) = objects.iter().find(|one| is_wrong(one, allowed)) else {
            mixed(action, &objects, &name, found);
            continue;
        };
        let (actor_name, kind) = (wrong.name(), wrong.kind().element());
        let text = if name == actor_name {
            format!("the actor `{actor_name}` is a `{kind}`, but `{what}` is for {who}")
        } else {
            format!(
                "`{actor_name}` of the selection `{name}` is a `{kind}`, but `{what}` is for {who}"
            )
        };
        let node = wrong.element(action.scenario()).node();
        found
            .about(action, "", text)
            .at(actor.node(), "the actor")
            .at(node, "the entity");
    }
}

/// What an external object is, only the simulator knows.
fn is_wrong(entity: &Entity<'_>, allowed: &[EntityKind]) -> bool {
    let known = !matches!(entity.kind(), EntityKind::External | EntityKind::Unknown);
    known && !allowed.contains(&entity.kind())
}

/// A selection acts as one: of vehicles or of pedestrians.
fn mixed(action: Element<'_, '_>, objects: &[&Entity<'_>], name: &str, found: &mut Sink<'_>) {
    let has = |kind| objects.iter().any(|one| one.kind() == kind);
    if has(EntityKind::Vehicle) && has(EntityKind::Pedestrian) {
        let text = format!(
            "the selection `{name}` has vehicles and pedestrians, but for a `{}` it may have one of the two \
             only",
            action.name()
        );
        found.about(action, "", text).level(Level::Information);
    }
}

fn master(action: Element<'_, '_>, found: &mut Sink<'_>) {
    let Some(name) = action.text("masterEntityRef") else {
        return;
    };
    let entities = action.scenario().entities();
    let Some(master) = entities.object(&name) else {
        return;
    };
    if master.kind() == EntityKind::MiscObject {
        let text = format!(
            "the master {} is a `MiscObject`, but only vehicles and pedestrians move to a place",
            quoted(action, "masterEntityRef", &name)
        );
        let node = master.element(action.scenario()).node();
        found
            .about(action, "masterEntityRef", text)
            .at(node, "the entity");
    }
}
