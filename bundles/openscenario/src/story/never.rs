//! Reasons why elements never start or end.

use super::reasons::{edge_of_time, ends_never, state_never_comes};
use super::waits;
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::timeline::{At, Cause, Strictness, Timeline};
use crate::wording::{called, described, short};

/// Returns why an element never starts.
pub(super) fn starts(scenario: &Scenario<'_>, timeline: &Timeline, place: usize) -> Option<String> {
    if !timeline.standard.get(place)?.start.is_never() {
        return None;
    }
    let one = scenario.storyboard().elements().get(place)?;
    if let Some(above) = one.parent()
        && timeline.standard.get(above)?.start.is_never()
    {
        let around = scenario.storyboard().elements().get(above)?;
        return Some(format!("{} never starts", called(around.element(scenario))));
    }
    let trigger = one.element(scenario).child("StartTrigger")?;
    let causes = timeline.never_starts(place, Strictness::Standard);
    all(scenario, timeline, trigger, &causes)
}

/// Returns why an element that starts never ends.
pub(super) fn ends(scenario: &Scenario<'_>, timeline: &Timeline, place: usize) -> Option<String> {
    let span = timeline.standard.get(place)?;
    let is_endless = span.complete.is_never() && !span.start.is_never();
    is_endless.then(|| ends_never(scenario, timeline, place))?
}

/// Returns why the run never ends.
pub(super) fn run_ends(scenario: &Scenario<'_>, timeline: &Timeline) -> Option<String> {
    let trigger = scenario.root().path(&["Storyboard", "StopTrigger"])?;
    let causes = timeline.never_ends(Strictness::Standard);
    all(scenario, timeline, trigger, &causes)
}

fn all<'d>(
    scenario: &Scenario<'d>,
    timeline: &Timeline,
    trigger: Element<'_, 'd>,
    causes: &[Cause],
) -> Option<String> {
    let reasons = causes.iter();
    let reasons = reasons.filter_map(|cause| reason(scenario, timeline, trigger, *cause));
    let mut reasons: Vec<String> = reasons.collect();
    reasons.dedup();
    (!reasons.is_empty()).then(|| reasons.join(", and because "))
}

fn reason<'d>(
    scenario: &Scenario<'d>,
    timeline: &Timeline,
    trigger: Element<'_, 'd>,
    cause: Cause,
) -> Option<String> {
    let condition = |at: At| {
        let group = trigger.children_named("ConditionGroup").nth(at.0)?;
        group.children_named("Condition").nth(at.1)
    };
    Some(match cause {
        Cause::StateNeverComes { at, of } => {
            let path = ["ByValueCondition", "StoryboardElementStateCondition"];
            let state = condition(at)?.path(&path)?;
            state_never_comes(scenario, timeline, state, of)
        }
        Cause::Impossible { at } => {
            let condition = condition(at)?;
            match scenario.impossible(condition) {
                Some(impossible) => described(&impossible),
                None => format!("it is never the case that {}", waits::condition(condition)),
            }
        }
        Cause::Over { at } => over(condition(at)?),
        Cause::Apart { one, other } => format!(
            "{} and {} are never true together",
            waits::condition(condition(one)?),
            waits::condition(condition(other)?)
        ),
        Cause::AfterTheEnd { first } => format!(
            "its trigger is first true at {} s, after the end of its act or of the run",
            short(first)
        ),
        Cause::Skipped { by } => {
            let other = scenario.storyboard().elements().get(by)?;
            let other = called(other.element(scenario));
            format!("it has the priority `skip`, and {other} runs whenever it is triggered")
        }
    })
}

/// Describes why a condition is never true when it is checked.
fn over(condition: Element<'_, '_>) -> String {
    let text = waits::condition(condition);
    match (edge_of_time(condition), condition.word("conditionEdge")) {
        (Some(no), _) => no.why,
        (None, Some(edge)) if edge != "none" => {
            format!("the `{edge}` edge of {text} comes before it is first looked at")
        }
        _ => format!("{text} is true only before it is first looked at"),
    }
}
