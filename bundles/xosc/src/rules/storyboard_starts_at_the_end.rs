use crate::families::actions::short;
use crate::families::triggers::{called, groups};
use crate::prelude::*;
use qcbus_openscenario::{Condition, Logic, Start, StoryKind, Strictness};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// Simulators need some steps between a trigger and the end of the run, in seconds.
const SLACK: f64 = 0.3;

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    // An element that ends the run by its own state starts before that.
    let by_time = |condition: &Condition| matches!(condition.logic, Logic::Time(..));
    let stop = timeline.plan.stop.iter().flat_map(|stop| &stop.groups);
    if !stop.flatten().all(by_time) {
        return;
    }
    let spans = &timeline.standard;
    let end = spans.ends;
    // Another rule reports a run that ends at once.
    if end.earliest <= SLACK {
        return;
    }
    let is_late = |place: usize| {
        let start = spans.get(place).map(|span| span.start);
        start.is_some_and(|start| {
            !start.is_never()
                && start.earliest >= end.earliest
                && end.latest <= start.earliest + SLACK
        })
    };
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        let has_trigger = matches!(one.kind(), StoryKind::Act | StoryKind::Event);
        if !has_trigger || !is_late(place) || one.parent().is_some_and(is_late) {
            continue;
        }
        // An element that waits for such an element is late because of that one.
        let is_timed = timeline
            .plan
            .parts
            .get(place)
            .is_some_and(|part| match &part.start {
                Start::By(trigger) => trigger.groups.iter().all(|group| group.iter().any(by_time)),
                _ => false,
            });
        if !is_timed {
            continue;
        }
        // Other rules report elements that never start.
        if !timeline
            .never_starts(place, Strictness::Standard)
            .is_empty()
        {
            continue;
        }
        if let Some(span) = spans.get(place) {
            report(one.element(scenario), span.start.earliest, found);
        }
    }
}

fn report(element: Element<'_, '_>, start: f64, found: &mut Sink<'_>) {
    let Some(trigger) = element.child("StartTrigger") else {
        return;
    };
    let text = format!(
        "{} starts at {} s at the earliest, but then the stop trigger ends the run; it has no effect, or starts in \
         the last step; start it earlier, or end the run later",
        called(element),
        short(start)
    );
    let mut conditions = groups(trigger).flatten();
    let place = match (conditions.next(), conditions.next()) {
        (Some(only), None) => only,
        _ => trigger,
    };
    let finding = found.about(place, "", text);
    let root = element.scenario().root();
    if let Some(stop) = root.path(&["Storyboard", "StopTrigger"]) {
        finding.at(stop.node(), "the trigger that ends the run");
    }
}
