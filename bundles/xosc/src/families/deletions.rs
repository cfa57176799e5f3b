//! Entities that are deleted for certain, and the storyboard elements that start after that.

use crate::prelude::*;
use qcbus_openscenario::{Logic, Plan, Spans, Start, State, StoryKind, Timeline};

/// A deletion of an entity that certainly happens.
pub(crate) struct Deletion<'m, 'd> {
    /// Name of the entity.
    pub(crate) entity: String,
    /// The `Action` that deletes it.
    pub(crate) action: Element<'m, 'd>,
    /// Latest time, in seconds of simulation time.
    pub(crate) latest: f64,
    /// For each element of the storyboard: whether it certainly starts after the deletion.
    after: Vec<bool>,
}

impl Deletion<'_, '_> {
    /// Checks whether an element of the storyboard certainly starts after the deletion.
    pub(crate) fn is_before(&self, place: usize) -> bool {
        self.after.get(place).copied().unwrap_or(false)
    }
}

/// Returns the first certain deletion of each entity. An entity that is added again, or may be, is
/// left out.
pub(crate) fn deletions<'m, 'd>(
    scenario: &'m Scenario<'d>,
    timeline: &Timeline,
) -> Vec<Deletion<'m, 'd>> {
    let Some(added) = added(scenario) else {
        return Vec::new();
    };
    let mut found: Vec<Deletion<'m, 'd>> = Vec::new();
    for (action, entity) in in_init(scenario) {
        if !added.contains(&entity) {
            found.push(Deletion {
                entity,
                action,
                latest: 0.0,
                after: all(timeline.tolerant(), timeline.plan.parts.len()),
            });
        }
    }
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        let action = one.element(scenario);
        let Some(deleted) = deleted_by(action) else {
            continue;
        };
        let latest = timeline.tolerant().get(place).map(|span| span.start.latest);
        let Some(latest) = latest.filter(|latest| latest.is_finite()) else {
            continue;
        };
        for entity in deleted.into_iter().filter(|name| !added.contains(name)) {
            match found.iter_mut().find(|other| other.entity == entity) {
                Some(other) if other.latest <= latest => {}
                other => {
                    let new = Deletion {
                        after: after(&timeline.plan, timeline.tolerant(), place, latest),
                        entity,
                        action,
                        latest,
                    };
                    match other {
                        Some(other) => *other = new,
                        None => found.push(new),
                    }
                }
            }
        }
    }
    found
}

/// Returns the names of the entities that actions add. Returns `None` if one is unknown.
pub(crate) fn added(scenario: &Scenario<'_>) -> Option<Vec<String>> {
    let mut added = Vec::new();
    for action in scenario.elements_everywhere("EntityAction") {
        if action.child("DeleteEntityAction").is_none() {
            added.extend(names(action)?);
        }
    }
    Some(added)
}

/// Returns the actions of `Init` that delete entities, and the names of these.
fn in_init<'m, 'd>(scenario: &'m Scenario<'d>) -> Vec<(Element<'m, 'd>, String)> {
    let init = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let actions = init
        .into_iter()
        .flat_map(|init| init.children_named("GlobalAction"))
        .filter_map(|global| global.child("EntityAction"))
        .filter(|action| action.child("DeleteEntityAction").is_some());
    actions
        .flat_map(|action| {
            let names = names(action).unwrap_or_default();
            names.into_iter().map(move |name| (action, name))
        })
        .collect()
}

/// Returns for each element that it starts after `Init`, unless it never starts.
fn all(spans: &Spans, count: usize) -> Vec<bool> {
    let starts = |place| spans.get(place).is_some_and(|span| !span.start.is_never());
    (0..count).map(starts).collect()
}

/// Returns the names of the entities that an `Action` deletes. Returns `None` for other actions.
pub(crate) fn deleted_by(action: Element<'_, '_>) -> Option<Vec<String>> {
    let action = action.path(&["GlobalAction", "EntityAction"])?;
    action.child("DeleteEntityAction")?;
    names(action)
}

fn names(action: Element<'_, '_>) -> Option<Vec<String>> {
    let name = action.text("entityRef")?;
    let entities = action.scenario().entities().expand(&name)?;
    Some(
        entities
            .into_iter()
            .map(|one| one.name().to_owned())
            .collect(),
    )
}

/// Returns for each element whether it certainly starts after the action at `first`, which starts
/// at `latest` at the latest.
fn after(plan: &Plan, spans: &Spans, first: usize, latest: f64) -> Vec<bool> {
    let around = std::iter::successors(Some(first), |at| plan.parts.get(*at)?.parent);
    let around: Vec<usize> = around.collect();
    let is_later = |place: &usize| {
        let start = spans.get(*place).map(|span| span.start);
        start.is_some_and(|start| !start.is_never() && start.earliest > latest)
    };
    let mut after: Vec<bool> = (0..plan.parts.len()).map(|at| is_later(&at)).collect();
    let mut changed = true;
    while changed {
        changed = false;
        for (place, part) in plan.parts.iter().enumerate() {
            if after.get(place) != Some(&false) || around.contains(&place) {
                continue;
            }
            let is_after = |at: usize| after.get(at) == Some(&true);
            let waits = |logic: &Logic| match logic {
                Logic::State(of, State::Complete | State::EndTransition) => {
                    is_after(*of) || around.contains(of)
                }
                Logic::State(of, State::Running | State::StartTransition) => is_after(*of),
                _ => false,
            };
            let by_trigger = match &part.start {
                Start::By(trigger) => trigger
                    .groups
                    .iter()
                    .all(|group| group.iter().any(|condition| waits(&condition.logic))),
                _ => false,
            };
            let is_after = part.parent.is_some_and(is_after) || by_trigger;
            if let Some(it) = after.get_mut(place).filter(|_| is_after) {
                *it = true;
                changed = true;
            }
        }
    }
    // An element that never starts is reported by another rule.
    for (place, it) in after.iter_mut().enumerate() {
        *it &= spans.get(place).is_some_and(|span| !span.start.is_never());
    }
    after
}

/// Returns the places of the actions within an element of the storyboard.
pub(crate) fn actions_within(plan: &Plan, of: usize) -> Vec<usize> {
    let within = |at: &usize| {
        let mut around = std::iter::successors(Some(*at), |at| plan.parts.get(*at)?.parent);
        around.any(|it| it == of)
    };
    let parts = plan.parts.iter().enumerate();
    let actions = parts.filter(|(_, part)| part.kind == StoryKind::Action);
    actions.map(|(at, _)| at).filter(within).collect()
}
