//! Actions that stop each other because they control the same thing.

use std::collections::BTreeMap;

use super::plan::StoryPart;
use crate::queries::actors::Actors;
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::storyboard::StoryKind;

/// Maximum number of compared actions of one entity. In larger stories, any action may be stopped.
const MOST: usize = 200;

/// Lists the rivals of each action. An action with unknown actors is a rival of every other one.
pub(super) fn fill(scenario: &Scenario<'_>, parts: &mut [StoryPart]) {
    let mut by_entity: BTreeMap<(String, Domain), Vec<usize>> = BTreeMap::new();
    let mut of_anybody: Vec<usize> = Vec::new();
    let mut deletions: Vec<(String, usize)> = Vec::new();
    let mut references: Vec<(String, usize)> = Vec::new();
    let elements = scenario.storyboard().elements();
    let actions = elements.iter().enumerate();
    let actions = actions.filter(|(_, one)| one.kind() == StoryKind::Action);
    for (place, one) in actions {
        let action = one.element(scenario);
        match deleted(action) {
            Some(name) => deletions.push((name, place)),
            None => references.extend(referenced(action).map(|name| (name, place))),
        }
        match entities(scenario, action) {
            Controls::Nothing => {}
            Controls::Entities(names, domains) => {
                for name in names {
                    for domain in domains {
                        by_entity
                            .entry((name.clone(), *domain))
                            .or_default()
                            .push(place);
                    }
                }
            }
            Controls::Unknown => of_anybody.push(place),
        }
    }
    for places in by_entity.values() {
        for place in places {
            let rivals = places.iter().chain(&of_anybody);
            add(parts, *place, rivals);
        }
    }
    // An action relative to an entity may end with this entity.
    for (name, place) in &references {
        let of_name = deletions.iter().filter(|(deleted, _)| deleted == name);
        let places: Vec<usize> = of_name.map(|(_, deletion)| *deletion).collect();
        add(parts, *place, places.iter());
    }
    let everybody: Vec<usize> = by_entity.into_values().flatten().collect();
    for place in &of_anybody {
        add(parts, *place, everybody.iter().chain(&of_anybody));
    }
}

/// Returns the name of the entity that an action deletes.
fn deleted(action: Element<'_, '_>) -> Option<String> {
    let entity = action.path(&["GlobalAction", "EntityAction"])?;
    entity.child("DeleteEntityAction")?;
    Some(entity.text("entityRef")?.into_owned())
}

/// Returns the names of the entities that an action refers to.
fn referenced(action: Element<'_, '_>) -> impl Iterator<Item = String> {
    const NAMES: [&str; 2] = ["entityRef", "masterEntityRef"];
    let within = action.descendants();
    within.flat_map(|one| {
        NAMES
            .into_iter()
            .filter_map(move |name| Some(one.text(name)?.into_owned()))
    })
}

fn add<'r>(parts: &mut [StoryPart], place: usize, rivals: impl Iterator<Item = &'r usize>) {
    let parent = parts.get(place).and_then(|part| part.parent);
    let mut found: Vec<usize> = rivals
        .copied()
        // Actions of one event start together.
        .filter(|rival| *rival != place && parts.get(*rival).and_then(|it| it.parent) != parent)
        .take(MOST + 1)
        .collect();
    let Some(part) = parts.get_mut(place) else {
        return;
    };
    part.is_open |= found.len() > MOST;
    part.rivals.append(&mut found);
    part.rivals.sort_unstable();
    part.rivals.dedup();
}

/// Part of an entity's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Domain {
    Longitudinal,
    Lateral,
}

const BOTH: &[Domain] = &[Domain::Longitudinal, Domain::Lateral];

/// The entities and the part of their motion that an action controls.
enum Controls {
    Nothing,
    Entities(Vec<String>, &'static [Domain]),
    Unknown,
}

fn entities(scenario: &Scenario<'_>, action: Element<'_, '_>) -> Controls {
    if let Some(entity) = action.path(&["GlobalAction", "EntityAction"]) {
        // A deleted entity ends its actions.
        return match entity.text("entityRef") {
            Some(name) => Controls::Entities(vec![name.into_owned()], BOTH),
            None => Controls::Unknown,
        };
    }
    let private = action.child("PrivateAction");
    let Some(kind) = private.and_then(|it| it.children().next()) else {
        return match action.child("UserDefinedAction") {
            Some(_) => Controls::Unknown,
            None => Controls::Nothing,
        };
    };
    let domains = match kind.name() {
        "VisibilityAction" | "AppearanceAction" => return Controls::Nothing,
        "LongitudinalAction" | "SynchronizeAction" => &[Domain::Longitudinal][..],
        "LateralAction" => &[Domain::Lateral],
        _ => BOTH,
    };
    let names = Actors::of(action).and_then(|actors| actors.names());
    let expanded = names.and_then(|names| {
        let each = names.iter().map(|name| scenario.entities().expand(name));
        each.collect::<Option<Vec<_>>>()
    });
    match expanded {
        Some(lists) => {
            let entities = lists.into_iter().flatten();
            Controls::Entities(entities.map(|it| it.name().to_owned()).collect(), domains)
        }
        None => Controls::Unknown,
    }
}
