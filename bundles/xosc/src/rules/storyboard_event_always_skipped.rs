use crate::families::timeline::{self, differs};
use crate::families::triggers::called;
use crate::prelude::*;
use qcbus_openscenario::Cause;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for never in timeline::never_started(scenario, timeline) {
        let skipped = never.causes.iter().find_map(|cause| match cause {
            Cause::Skipped { by } => Some(*by),
            _ => None,
        });
        let (Some(by), Some(event)) = (skipped, never.owner()) else {
            continue;
        };
        // A scenario that waits for the skip wants it.
        if is_awaited(scenario, event) {
            continue;
        }
        let other = scenario.storyboard().elements().get(by);
        let other = other.map(|one| one.element(scenario));
        let name = other.map_or_else(|| "another event".to_owned(), called);
        let text = format!(
            "{name} runs whenever this event with the priority `skip` is triggered; {}{}",
            never.so,
            differs(&never)
        );
        let finding = found
            .about(event, "priority", text)
            .maybe_fault(timeline::start_of(event));
        if let Some(other) = other {
            finding.at(other.node(), "the event that runs");
        }
    }
}

/// Checks whether a condition is about the skip of an event.
fn is_awaited<'d>(scenario: &Scenario<'d>, event: Element<'_, 'd>) -> bool {
    let states = scenario.elements_everywhere("StoryboardElementStateCondition");
    let mut skips = states.filter(|it| it.word("state").as_deref() == Some("skipTransition"));
    skips.any(|state| {
        let Some(name) = state.text("storyboardElementRef") else {
            return true;
        };
        let found = scenario.storyboard().find(&name);
        found.iter().any(|one| one.element(scenario) == event)
    })
}
