use crate::families::triggers::{Kinds, called};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for maneuver in scenario.elements_everywhere("Maneuver") {
        let events: Vec<_> = maneuver.children_named("Event").collect();
        if events.len() < 2 {
            continue;
        }
        let mut kinds = Kinds::default();
        let mut first: HashMap<usize, Element<'_, '_>> = HashMap::new();
        for event in events {
            let trigger = kinds.of(event.child("StartTrigger"));
            match first.get(&trigger) {
                Some(other) => {
                    compare(*other, event, found);
                }
                None => {
                    first.insert(trigger, event);
                }
            }
        }
    }
}

fn compare(first: Element<'_, '_>, event: Element<'_, '_>, found: &mut Sink<'_>) {
    let (Some(one), Some(other)) = (first.word("priority"), event.word("priority")) else {
        return;
    };
    let ranked = |word: &str| matches!(word, "overwrite" | "override" | "skip");
    if !ranked(&one) && !ranked(&other) {
        return;
    }
    let text = format!(
        "{} is started by the same trigger as {}, with priority `{other}` instead of `{one}`; which of them \
         continues depends on the order in which the simulator starts them",
        called(event),
        called(first)
    );
    found.about(event, "priority", text).at(
        first.node(),
        "the event that is started by the same trigger",
    );
}
