//! Elements that never start, and runs that never end, by the timeline of the scenario.

use crate::families::triggers::called;
use crate::prelude::*;
use qcbus_openscenario::story::never_starts_within;
use qcbus_openscenario::{At, Cause, Logic, Start, Strictness, Timeline};
use qcbus_sdk::fault_of;

pub(crate) use qcbus_openscenario::story::state_never_comes;

/// A trigger that is never true.
pub(crate) struct Never<'m, 'd> {
    /// Index of the element; 0 for the run.
    pub(crate) place: usize,
    /// `StartTrigger` of an element, or `StopTrigger` of the storyboard.
    trigger: Element<'m, 'd>,
    /// The consequence, for messages.
    pub(crate) so: String,
    /// Reason of each condition group.
    pub(crate) causes: Vec<Cause>,
    /// Whether every known simulator agrees.
    pub(crate) is_certain: bool,
}

impl<'m, 'd> Never<'m, 'd> {
    /// Returns a condition of the trigger.
    pub(crate) fn condition(&self, at: At) -> Option<Element<'m, 'd>> {
        let group = self.trigger.children_named("ConditionGroup").nth(at.0)?;
        group.children_named("Condition").nth(at.1)
    }

    /// Returns the owner of the trigger.
    pub(crate) fn owner(&self) -> Option<Element<'m, 'd>> {
        self.trigger.parent()
    }
}

/// Returns the acts and events that never start because of their own trigger.
pub(crate) fn never_started<'m, 'd>(
    scenario: &'m Scenario<'d>,
    timeline: &Timeline,
) -> Vec<Never<'m, 'd>> {
    let elements = scenario.storyboard().elements().iter().enumerate();
    let never = elements.filter_map(|(place, one)| {
        let causes = timeline.never_starts(place, Strictness::Standard);
        if causes.is_empty() {
            return None;
        }
        let element = one.element(scenario);
        let tolerant = timeline.tolerant().get(place)?;
        Some(Never {
            place,
            trigger: element.child("StartTrigger")?,
            so: format!("{} never starts", called(element)),
            causes,
            is_certain: tolerant.start.is_never(),
        })
    });
    never.collect()
}

/// Visits each cause why an act or event never starts.
pub(crate) fn each_cause<'m, 'd>(
    scenario: &'m Scenario<'d>,
    mut visit: impl FnMut(&Timeline, &Never<'m, 'd>, Cause),
) {
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for never in never_started(scenario, timeline) {
        for cause in &never.causes {
            visit(timeline, &never, *cause);
        }
    }
}

/// Returns the stop trigger of the storyboard if it is never true.
pub(crate) fn never_ended<'m, 'd>(
    scenario: &'m Scenario<'d>,
    timeline: &Timeline,
) -> Option<Never<'m, 'd>> {
    let causes = timeline.never_ends(Strictness::Standard);
    if causes.is_empty() {
        return None;
    }
    Some(Never {
        place: 0,
        trigger: scenario.root().path(&["Storyboard", "StopTrigger"])?,
        so: "the run never ends".to_owned(),
        causes,
        is_certain: timeline.tolerant().ends.is_never(),
    })
}

/// Returns the name of the fault that an act or event never starts. `element` is the act or event,
/// or lies in its trigger. It is `None` in the stop trigger of the run.
pub(crate) fn start_of(element: Element<'_, '_>) -> Option<String> {
    let mut around = std::iter::successors(Some(element), |it| it.parent());
    let owner = around.find(|it| it.is("Event") || it.is("Act"))?;
    Some(format!("start of {}", fault_of(owner.node())))
}

/// Returns the name of the fault that keeps an element from its start or end: another one within
/// it never starts.
pub(crate) fn start_within(
    scenario: &Scenario<'_>,
    timeline: &Timeline,
    of: usize,
) -> Option<String> {
    let element = scenario
        .storyboard()
        .elements()
        .get(never_starts_within(timeline, of)?)?;
    start_of(element.element(scenario))
}

/// Checks whether the run never ends because of a condition. Then only this is reported.
pub(crate) fn keeps_running<'d>(scenario: &Scenario<'d>, condition: Element<'_, 'd>) -> bool {
    // Most conditions belong to other triggers.
    if condition.ancestor("Story").is_some() {
        return false;
    }
    let never = scenario
        .timeline()
        .and_then(|timeline| never_ended(scenario, timeline));
    never.is_some_and(|never| {
        never.causes.iter().any(|cause| match cause {
            Cause::Impossible { at } | Cause::Over { at } | Cause::Apart { other: at, .. } => {
                never.condition(*at) == Some(condition)
            }
            _ => false,
        })
    })
}

/// Checks whether an element waits for itself or for an element around it, which other findings
/// report.
pub(crate) fn waits_for_itself(timeline: &Timeline, place: usize) -> bool {
    let parts = &timeline.plan.parts;
    let Some(Start::By(trigger)) = parts.get(place).map(|part| &part.start) else {
        return false;
    };
    let parent = |at: &usize| parts.get(*at)?.parent;
    let around: Vec<usize> = std::iter::successors(Some(place), parent).collect();
    let mut conditions = trigger.groups.iter().flatten();
    conditions.any(|condition| match &condition.logic {
        Logic::State(of, _) => around.contains(of),
        _ => false,
    })
}

/// Checks whether another finding reports why a state never comes: its element never starts, or it
/// is the end of an element around the one that waits.
pub(crate) fn follows(
    timeline: &Timeline,
    state: Element<'_, '_>,
    of: usize,
    waits: usize,
) -> bool {
    let parent = |at: &usize| timeline.plan.parts.get(*at)?.parent;
    let span = timeline.standard.get(of);
    let is_end = state
        .word("state")
        .is_some_and(|word| !matches!(&*word, "standbyState" | "skipTransition"));
    span.is_some_and(|span| span.start.is_never())
        || (is_end && std::iter::successors(Some(waits), parent).any(|around| around == of))
}

/// Returns " (some simulators …)" if they differ.
pub(crate) fn differs(never: &Never<'_, '_>) -> &'static str {
    match never.is_certain {
        true => "",
        false => "; some simulators differ from the standard here",
    }
}
