//! Reasons why states and edges never come.

use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::timeline::{Plan, Takes, Timeline};
use crate::types::storyboard::StoryKind;
use crate::wording::{called, stated};

/// Returns the `SimulationTimeCondition` of a condition.
pub fn time<'m, 'd>(condition: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    condition.path(&["ByValueCondition", "SimulationTimeCondition"])
}

/// Reason why the edge of a condition never occurs.
#[derive(Debug)]
pub struct NoEdge {
    /// The reason.
    pub why: String,
    /// Whether it occurs if the first look counts as a change.
    pub is_disputed: bool,
}

/// Returns why the edge of a condition about the simulation time never occurs. The time starts at 0
/// and only increases.
pub fn edge_of_time(condition: Element<'_, '_>) -> Option<NoEdge> {
    let edge = condition.word("conditionEdge")?;
    let time = time(condition)?;
    let value = time.number("value")?;
    let rule = time.word("rule")?;
    let wanted = stated(time, "value", value);
    let (why, is_disputed) = match (&*edge, &*rule) {
        ("falling", "greaterThan" | "greaterOrEqual") => (
            format!(
                "the time becomes greater than {wanted} s and stays so; a `falling` edge never occurs, only a \
                 `rising` one does"
            ),
            false,
        ),
        // The rule `trigger_never_true` reports smaller values.
        ("rising", "lessThan" | "lessOrEqual")
            if value > 0.0 || (value == 0.0 && &*rule == "lessOrEqual") =>
        {
            (
                format!(
                    "the time is less than {wanted} s from the beginning; a `rising` edge never occurs, only a \
                     `falling` one does"
                ),
                false,
            )
        }
        ("rising", "equalTo" | "greaterOrEqual") if value == 0.0 => (
            format!(
                "at {wanted} s the condition is true in the very first step, and there is no earlier step to \
                 rise from; strictly, the edge never occurs; use `conditionEdge=\"none\"`"
            ),
            true,
        ),
        _ => return None,
    };
    Some(NoEdge { why, is_disputed })
}

/// Describes why the state of an element never comes: "`endTransition` of the event `Brake` never
/// comes, because …". `condition` is the `StoryboardElementStateCondition`.
pub fn state_never_comes(
    scenario: &Scenario<'_>,
    timeline: &Timeline,
    condition: Element<'_, '_>,
    of: usize,
) -> String {
    let word = condition.word("state").unwrap_or_default().into_owned();
    let element = scenario.storyboard().elements().get(of);
    let name = element.map_or_else(
        || "the element".to_owned(),
        |one| called(one.element(scenario)),
    );
    let why = match why(scenario, timeline, &word, of) {
        Some(why) => format!(", because {why}"),
        None => String::new(),
    };
    format!("`{word}` of {name} never comes{why}")
}

/// Describes why an element never ends: "the action `Follow` has `continuous="true"` and does not
/// end by itself".
pub fn ends_never(scenario: &Scenario<'_>, timeline: &Timeline, of: usize) -> Option<String> {
    why(scenario, timeline, "completeState", of)
}

fn why(scenario: &Scenario<'_>, timeline: &Timeline, word: &str, of: usize) -> Option<String> {
    let plan = &timeline.plan;
    let part = plan.parts.get(of)?;
    match word {
        "skipTransition" => {
            let is_event = part.kind == StoryKind::Event;
            Some(match is_event {
                true => "only events with the priority `skip` are skipped, while another event of \
                         their maneuver runs"
                    .to_owned(),
                false => "only events are skipped".to_owned(),
            })
        }
        "stopTransition" => Some("nothing stops it".to_owned()),
        _ => {
            let within = |at: &usize| {
                let mut around = std::iter::successors(Some(*at), |at| plan.parts.get(*at)?.parent);
                around.any(|it| it == of)
            };
            let mut places = (0..plan.parts.len()).filter(within);
            places
                .find_map(|at| endless(scenario, plan, at, of))
                .or_else(|| idle(scenario, timeline, of))
        }
    }
}

/// Describes an element that does not end. It is `it` if it is the element of the sentence.
fn endless(scenario: &Scenario<'_>, plan: &Plan, at: usize, it: usize) -> Option<String> {
    let part = plan.parts.get(at)?;
    let element = scenario.storyboard().elements().get(at)?;
    let name = match at == it {
        true => "it".to_owned(),
        false => called(element.element(scenario)),
    };
    match (part.takes, part.executions) {
        (Takes::Forever | Takes::ForeverInTheory, _) => Some(format!(
            "{name} has `continuous=\"true\"` and does not end by itself"
        )),
        (_, Some(count)) if count > 1 && part.kind == StoryKind::Event => Some(format!(
            "{name} has `maximumExecutionCount=\"{count}\"`, but is triggered less often"
        )),
        _ => None,
    }
}

/// Describes an element that keeps another one from its end because it never starts.
fn idle(scenario: &Scenario<'_>, timeline: &Timeline, of: usize) -> Option<String> {
    let at = never_starts_within(timeline, of)?;
    let name = match at == of {
        true => "it".to_owned(),
        false => called(scenario.storyboard().elements().get(at)?.element(scenario)),
    };
    Some(format!("{name} never starts"))
}

/// Returns the first element in another one, or that one, that never starts.
pub fn never_starts_within(timeline: &Timeline, of: usize) -> Option<usize> {
    let parent = |at: &usize| timeline.plan.parts.get(*at)?.parent;
    let is_idle = |at: &usize| {
        let span = timeline.standard.get(*at);
        span.is_some_and(|span| span.start.is_never())
            && std::iter::successors(Some(*at), parent).any(|around| around == of)
    };
    (0..timeline.plan.parts.len()).find(is_idle)
}
