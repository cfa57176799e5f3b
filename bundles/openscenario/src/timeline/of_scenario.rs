//! Reads the plan of a scenario.

use foldhash::{HashMap, HashMapExt as _};

use super::plan::{
    Comparison, Condition, Edge, Logic, Plan, Priority, Start, State, StoryPart, Takes, Trigger,
};
use super::rivals;
use super::takes::takes;
use super::time_of_day::{TimeOfDay, comparison_in_seconds};
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::storyboard::StoryKind;

/// Returns the plan of a scenario's storyboard. Returns `None` if a part of it is unknown, such as a
/// maneuver of a missing catalog.
pub(super) fn plan(scenario: &Scenario<'_>) -> Option<Plan> {
    let storyboard = scenario.storyboard();
    if !storyboard.is_complete() {
        return None;
    }
    let root = scenario.root().child("Storyboard")?;
    let elements = storyboard.elements();
    let mut places: HashMap<(u32, u32), usize> = HashMap::new();
    for (place, one) in elements.iter().enumerate() {
        places.insert((one.context, one.node.offset()), place);
    }
    let reader = Reader { scenario, places };
    let mut parts: Vec<StoryPart> = elements
        .iter()
        .map(|one| reader.part(one.kind(), one.parent(), one.element(scenario)))
        .collect();
    rivals::fill(scenario, &mut parts);
    let stop = root.child("StopTrigger").map(|it| reader.trigger(it));
    Some(Plan { parts, stop })
}

struct Reader<'m, 'd> {
    scenario: &'m Scenario<'d>,
    /// Indices of the elements by their context and the offset of their node.
    places: HashMap<(u32, u32), usize>,
}

impl Reader<'_, '_> {
    fn part(&self, kind: StoryKind, parent: Option<usize>, element: Element<'_, '_>) -> StoryPart {
        let start = match element.child("StartTrigger") {
            Some(trigger) if matches!(kind, StoryKind::Act | StoryKind::Event) => {
                let trigger = self.trigger(trigger);
                match trigger.groups.is_empty() {
                    // By the standard it is never true. Some simulators start the element at once.
                    true => Start::Unknown,
                    false => Start::By(trigger),
                }
            }
            _ => Start::WithParent,
        };
        let stop = element
            .child("StopTrigger")
            .filter(|_| kind == StoryKind::Act);
        StoryPart {
            kind,
            parent,
            start,
            stop: stop.map(|stop| self.trigger(stop)),
            executions: executions(element),
            priority: match kind {
                StoryKind::Event => priority(element),
                _ => Priority::Parallel,
            },
            takes: match kind {
                StoryKind::Action => takes(element),
                _ => Takes::Unknown,
            },
            rivals: Vec::new(),
            is_open: false,
        }
    }

    fn trigger(&self, trigger: Element<'_, '_>) -> Trigger {
        let groups = trigger.children_named("ConditionGroup");
        let groups = groups.map(|group| {
            let conditions = group.children_named("Condition");
            conditions.map(|it| self.condition(it)).collect()
        });
        Trigger {
            groups: groups.collect(),
        }
    }

    fn condition(&self, condition: Element<'_, '_>) -> Condition {
        let delay = match condition.has("delay") {
            true => condition.number("delay").filter(|delay| *delay >= 0.0),
            false => Some(0.0),
        };
        let (logic, is_certain) = match self.scenario.impossible(condition) {
            Some(impossible) => (Logic::Never, impossible.reason.is_certain()),
            None => self.logic(condition).unwrap_or((Logic::Unknown, true)),
        };
        Condition {
            logic,
            edge: edge(condition),
            delay,
            is_certain,
        }
    }

    fn logic(&self, condition: Element<'_, '_>) -> Option<(Logic, bool)> {
        let by_value = condition.child("ByValueCondition")?;
        if let Some(day) = by_value.child("TimeOfDayCondition") {
            // Some simulators have no time of day.
            return Some((time_of_day(day)?, false));
        }
        Some((self.value(by_value)?, true))
    }

    fn value(&self, by_value: Element<'_, '_>) -> Option<Logic> {
        if let Some(time) = by_value.child("SimulationTimeCondition") {
            let value = time.number("value")?;
            return Some(Logic::Time(comparison(&time.word("rule")?)?, value));
        }
        let element = by_value.child("StoryboardElementStateCondition")?;
        let kind = StoryKind::of_word(&element.word("storyboardElementType")?)?;
        let name = element.text("storyboardElementRef")?;
        let found = self.scenario.storyboard().find(&name);
        let mut found = found.into_iter().filter(|it| it.kind() == kind);
        // Several elements of one name: it is unknown which is meant.
        let (Some(target), None) = (found.next(), found.next()) else {
            return None;
        };
        let place = self.places.get(&(target.context, target.node.offset()))?;
        Some(Logic::State(*place, state(&element.word("state")?)?))
    }
}

/// Returns a condition about the time of day as one about the simulation time.
fn time_of_day(condition: Element<'_, '_>) -> Option<Logic> {
    let (rule, seconds) = comparison_in_seconds(condition)?;
    let passes = TimeOfDay::of(condition.scenario())?.passes;
    let rule = comparison(&rule)?;
    match passes {
        true => Some(Logic::Time(rule, seconds)),
        // It stands still, and the condition is not impossible.
        false => Some(Logic::Time(Comparison::GreaterOrEqual, 0.0)),
    }
}

fn executions(element: Element<'_, '_>) -> Option<u32> {
    match element.has("maximumExecutionCount") {
        true => u32::try_from(element.integer("maximumExecutionCount")?)
            .ok()
            .filter(|count| *count > 0),
        false => Some(1),
    }
}

fn priority(event: Element<'_, '_>) -> Priority {
    match event.word("priority").as_deref() {
        Some("parallel") => Priority::Parallel,
        Some("override" | "overwrite") => Priority::Override,
        Some("skip") => Priority::Skip,
        _ => Priority::Unknown,
    }
}

fn edge(condition: Element<'_, '_>) -> Edge {
    match condition.word("conditionEdge").as_deref() {
        Some("none") => Edge::None,
        Some("rising") => Edge::Rising,
        Some("falling") => Edge::Falling,
        Some("risingOrFalling") => Edge::RisingOrFalling,
        _ => Edge::Unknown,
    }
}

fn comparison(rule: &str) -> Option<Comparison> {
    Some(match rule {
        "equalTo" => Comparison::EqualTo,
        "greaterThan" => Comparison::GreaterThan,
        "lessThan" => Comparison::LessThan,
        "greaterOrEqual" => Comparison::GreaterOrEqual,
        "lessOrEqual" => Comparison::LessOrEqual,
        "notEqualTo" => Comparison::NotEqualTo,
        _ => return None,
    })
}

fn state(word: &str) -> Option<State> {
    Some(match word {
        "standbyState" => State::Standby,
        "runningState" => State::Running,
        "completeState" => State::Complete,
        "startTransition" => State::StartTransition,
        "endTransition" => State::EndTransition,
        "stopTransition" => State::StopTransition,
        "skipTransition" => State::SkipTransition,
        _ => return None,
    })
}
