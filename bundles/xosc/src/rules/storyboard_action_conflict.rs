use crate::families::actions::{Domain, acting, domains};
use crate::families::triggers::{Kinds, called, events};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// An action and its event.
type Taken<'m, 'd> = (Element<'m, 'd>, Element<'m, 'd>);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for act in scenario.elements("Act") {
        let events: Vec<_> = events(act).collect();
        let mut actions = events
            .iter()
            .flat_map(|event| event.children_named("Action"));
        if actions.nth(1).is_none() {
            continue;
        }
        let mut kinds = Kinds::default();
        let mut taken: HashMap<(usize, &str, Domain), Taken<'_, '_>> = HashMap::new();
        // All events of a maneuver have the same actors.
        let mut of_maneuver = None;
        for event in events {
            let trigger = kinds.of(event.child("StartTrigger"));
            let maneuver = event.parent();
            let actors = match &of_maneuver {
                Some((known, actors)) if *known == maneuver => actors,
                _ => {
                    let actors = acting(event).unwrap_or_default();
                    &of_maneuver.insert((maneuver, actors)).1
                }
            };
            for action in event.children_named("Action") {
                take((trigger, event), action, actors, &mut taken, found);
            }
        }
    }
}

fn take<'m, 'd>(
    (trigger, event): (usize, Element<'m, 'd>),
    action: Element<'m, 'd>,
    actors: &[&'m Entity<'d>],
    taken: &mut HashMap<(usize, &'m str, Domain), Taken<'m, 'd>>,
    found: &mut Sink<'_>,
) {
    let Some(private) = action.child("PrivateAction") else {
        return;
    };
    let domains = domains(private);
    if domains.is_empty() {
        return;
    }
    for entity in actors {
        for domain in &domains {
            let key = (trigger, entity.name(), *domain);
            let Some((other, its_event)) = taken.get(&key).copied() else {
                taken.insert(key, (action, event));
                continue;
            };
            if other == action || by_priority(event, its_event) {
                continue;
            }
            let text = format!(
                "{} and {} are started by the same trigger and both control the {} motion of `{}`; which of them \
                 takes effect depends on the simulator",
                called(action),
                called(other),
                domain.word(),
                entity.name()
            );
            found
                .about(action, "", text)
                .at(other.node(), "the action that starts together with it");
            return;
        }
    }
}

/// Checks whether both events are in one maneuver and depend on their priorities. Another rule
/// checks these.
fn by_priority<'d>(event: Element<'_, 'd>, other: Element<'_, 'd>) -> bool {
    let parallel = |one: Element<'_, 'd>| one.word("priority").as_deref() == Some("parallel");
    event != other && event.parent() == other.parent() && !(parallel(event) && parallel(other))
}
