use crate::families::actions::acting;
use crate::families::deletions::{self, Deletion};
use crate::families::triggers::called;
use crate::prelude::*;
use qcbus_openscenario::{StoryKind, Timeline};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario
        .elements_everywhere("DeleteEntityAction")
        .next()
        .is_none()
    {
        return;
    }
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for deletion in deletions::deletions(scenario, timeline) {
        let idle = idle_groups(scenario, timeline, &deletion, found);
        let elements = scenario.storyboard().elements().iter().enumerate();
        for (place, one) in elements.filter(|(place, _)| deletion.is_before(*place)) {
            let element = one.element(scenario);
            let is_idle = around(timeline, place).any(|at| idle.contains(&at));
            match one.kind() {
                StoryKind::Action => action(element, is_idle, &deletion, found),
                StoryKind::Act | StoryKind::Event if !is_idle => {
                    if let Some(trigger) = element.child("StartTrigger") {
                        uses(trigger, element, &deletion, found);
                    }
                }
                _ => {}
            }
        }
    }
}

fn around(timeline: &Timeline, place: usize) -> impl Iterator<Item = usize> + '_ {
    std::iter::successors(Some(place), |at| timeline.plan.parts.get(*at)?.parent)
}

/// Reports groups whose only actor is deleted before all their actions. Returns their places.
fn idle_groups(
    scenario: &Scenario<'_>,
    timeline: &Timeline,
    deletion: &Deletion<'_, '_>,
    found: &mut Sink<'_>,
) -> Vec<usize> {
    let mut idle = Vec::new();
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        if one.kind() != StoryKind::ManeuverGroup {
            continue;
        }
        let group = one.element(scenario);
        let actions = deletions::actions_within(&timeline.plan, place);
        let all_later = actions.iter().all(|at| deletion.is_before(*at));
        if actions.is_empty() || !all_later {
            continue;
        }
        let is_private = |at: &usize| {
            let action = scenario.storyboard().elements().get(*at);
            action.is_some_and(|it| it.element(scenario).child("PrivateAction").is_some())
        };
        if !actions.iter().any(is_private) {
            continue;
        }
        if is_only_actor(group, &deletion.entity) {
            let of = format!("the actor of {}, whose actions start", called(group));
            say(group, "", &of, deletion, found);
            idle.push(place);
        } else if let Some(actor) = named_actor(group, &deletion.entity) {
            let of = format!("an actor of {}, whose actions start", called(group));
            say(actor, "entityRef", &of, deletion, found);
        }
    }
    idle
}

/// Returns the `EntityRef` of an actor.
fn named_actor<'m, 'd>(group: Element<'m, 'd>, entity: &str) -> Option<Element<'m, 'd>> {
    let mut actors = group.child("Actors")?.children_named("EntityRef");
    actors.find(|actor| actor.text("entityRef").is_some_and(|name| name == entity))
}

fn is_only_actor(element: Element<'_, '_>, entity: &str) -> bool {
    let acting = acting(element).unwrap_or_default();
    matches!(acting.as_slice(), [only] if only.name() == entity)
}

fn action(
    element: Element<'_, '_>,
    is_idle: bool,
    deletion: &Deletion<'_, '_>,
    found: &mut Sink<'_>,
) {
    let private = element.child("PrivateAction");
    if private.is_some() && is_idle {
        return;
    }
    if let Some(kind) = private.and_then(|it| it.children().next())
        && is_only_actor(element, &deletion.entity)
    {
        let of = format!("the actor of {}, which starts", called(element));
        say(kind, "", &of, deletion, found);
        return;
    }
    uses(element, element, deletion, found);
}

/// Reports references to the entity within an element.
fn uses(
    within: Element<'_, '_>,
    owner: Element<'_, '_>,
    deletion: &Deletion<'_, '_>,
    found: &mut Sink<'_>,
) {
    const NAMES: [&str; 2] = ["entityRef", "masterEntityRef"];
    for element in within.descendants() {
        // The other entities may still trigger it.
        let around = element.parent().filter(|it| it.is("TriggeringEntities"));
        let is_one_of_many = around.is_some_and(|it| {
            let all = it.word("triggeringEntitiesRule").as_deref() == Some("all");
            !all && it.children_named("EntityRef").nth(1).is_some()
        });
        // A delayed condition may look at what was before the deletion.
        let condition = element.ancestor("Condition");
        let is_delayed = condition
            .is_some_and(|it| it.number("delay").is_none_or(|by| by > 0.0) && it.has("delay"));
        for name in NAMES.into_iter().filter(|_| !is_one_of_many && !is_delayed) {
            let is_it = element.text(name).is_some_and(|it| it == deletion.entity);
            if is_it {
                let of = format!("used by {}, which starts", called(owner));
                say(element, name, &of, deletion, found);
            }
        }
    }
}

fn say(
    element: Element<'_, '_>,
    attribute: &str,
    of: &str,
    deletion: &Deletion<'_, '_>,
    found: &mut Sink<'_>,
) {
    let text = format!(
        "`{}` is {of} only after {} has deleted this entity; this has no effect; start it before, remove it, or add \
         the entity again by `AddEntityAction`",
        deletion.entity,
        called(deletion.action)
    );
    found
        .about(element, attribute, text)
        .at(deletion.action.node(), "the action that deletes it");
}
