//! Conditions about the state of storyboard elements, and the waits between elements.

use std::borrow::Cow;

use crate::families::triggers::groups;
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};
use qcbus_openscenario::StoryElement;
use qcbus_openscenario::StoryKind;

/// A condition of a start trigger about the state of one known element.
pub(crate) struct StateCondition<'m, 'd> {
    /// The `StoryboardElementStateCondition`.
    pub(crate) element: Element<'m, 'd>,
    /// The element that it is about.
    pub(crate) target: Element<'m, 'd>,
    /// The state.
    pub(crate) state: Cow<'d, str>,
}

/// Conditions about states, by the groups of a trigger.
pub(crate) type StateGroups<'m, 'd> = Vec<Vec<StateCondition<'m, 'd>>>;

/// Returns each act and event with its own start trigger. Each group has its conditions about
/// states of known elements. Other conditions are left out.
pub(crate) fn own_triggers<'m, 'd>(
    scenario: &'m Scenario<'d>,
) -> impl Iterator<Item = (&'m StoryElement<'d>, StateGroups<'m, 'd>)> {
    scenario
        .storyboard()
        .elements()
        .iter()
        .filter_map(move |owner| {
            let trigger = owner.element(scenario).child("StartTrigger")?;
            let states =
                |group: Vec<Element<'m, 'd>>| group.into_iter().filter_map(state).collect();
            Some((owner, groups(trigger).map(states).collect()))
        })
}

fn state<'m, 'd>(condition: Element<'m, 'd>) -> Option<StateCondition<'m, 'd>> {
    let element = condition.path(&["ByValueCondition", "StoryboardElementStateCondition"])?;
    // A state may end at any time, so other edges are left out.
    let edge = condition.word("conditionEdge")?;
    if !matches!(&*edge, "none" | "rising") {
        return None;
    }
    let scenario = element.scenario();
    let name = element.text("storyboardElementRef")?;
    let kind = StoryKind::of_word(&element.word("storyboardElementType")?)?;
    let state = element.word("state")?;
    let matches = scenario.storyboard().find(&name);
    let mut of_kind = matches.into_iter().filter(|one| one.kind() == kind);
    match (of_kind.next(), of_kind.next()) {
        (Some(target), None) => Some(StateCondition {
            element,
            target: target.element(scenario),
            state,
        }),
        // A missing target is reported elsewhere. If there are several, the intended one is
        // unknown.
        _ => None,
    }
}

/// Elements of the storyboard that wait for each other.
pub(crate) struct Waiting<'m, 'd> {
    elements: &'m [StoryElement<'d>],
    /// Condition groups of each element's trigger. An element without any has no entry.
    triggers: HashMap<usize, Vec<Vec<Wait<'m, 'd>>>>,
    starts: Vec<bool>,
}

/// An element that must have started before a condition is true.
#[derive(Clone, Copy)]
pub(crate) struct Wait<'m, 'd> {
    /// The `StoryboardElementStateCondition`.
    pub(crate) condition: Element<'m, 'd>,
    /// Index of the element that must have started.
    pub(crate) on: usize,
}

impl<'m, 'd> Waiting<'m, 'd> {
    /// Determines which elements can start. The parent must be able to start. One group of the
    /// trigger must wait only for elements that can. Unknown conditions count as true.
    pub(crate) fn of(scenario: &'m Scenario<'d>) -> Waiting<'m, 'd> {
        let elements = scenario.storyboard().elements();
        let mut waiting = Waiting {
            elements,
            triggers: HashMap::new(),
            starts: vec![false; elements.len()],
        };
        let places: HashMap<u64, Vec<usize>> = places(scenario);
        for (place, owner) in elements.iter().enumerate() {
            let element = owner.element(scenario);
            let Some(trigger) = element.child("StartTrigger") else {
                continue;
            };
            // Another rule reports an empty trigger. Here it delays no element.
            let mut own: Vec<Vec<Wait<'m, 'd>>> = Vec::new();
            for group in groups(trigger) {
                let states = group.into_iter().filter_map(state);
                let waits = states.filter_map(|one| waiting.wait(scenario, &places, &one, place));
                own.push(waits.collect());
            }
            if !own.is_empty() {
                waiting.triggers.insert(place, own);
            }
        }
        waiting.settle();
        waiting
    }

    /// Returns the element that must start before a condition of the element at `owner` can be
    /// true.
    fn wait(
        &self,
        scenario: &'m Scenario<'d>,
        places: &HashMap<u64, Vec<usize>>,
        condition: &StateCondition<'m, 'd>,
        owner: usize,
    ) -> Option<Wait<'m, 'd>> {
        let candidates = places.get(&condition.target.node().offset().into())?;
        let target = candidates.iter().copied().find(|place| {
            self.elements
                .get(*place)
                .is_some_and(|one| one.element(scenario) == condition.target)
        })?;
        if target == owner {
            return None;
        }
        let on = match &*condition.state {
            "runningState" | "startTransition" | "endTransition" => target,
            "standbyState" | "skipTransition" => self.parent(target)?,
            // An element that never started is also complete once the act around it is stopped.
            "completeState" | "stopTransition" => {
                let around = std::iter::successors(Some(target), |place| self.parent(*place));
                let stopped = |place: &usize| {
                    self.elements
                        .get(*place)
                        .is_some_and(|one| one.element(scenario).child("StopTrigger").is_some())
                };
                around.into_iter().find(stopped).unwrap_or(target)
            }
            _ => return None,
        };
        Some(Wait {
            condition: condition.element,
            on,
        })
    }

    fn parent(&self, place: usize) -> Option<usize> {
        self.elements.get(place)?.parent()
    }

    /// Starts every element that can start, until no more can.
    fn settle(&mut self) {
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); self.elements.len()];
        let mut waiters: Vec<Vec<usize>> = vec![Vec::new(); self.elements.len()];
        let mut open: Vec<usize> = Vec::new();
        for place in 0..self.elements.len() {
            match self
                .parent(place)
                .and_then(|parent| children.get_mut(parent))
            {
                Some(siblings) => siblings.push(place),
                None => open.push(place),
            }
            for wait in self.triggers.get(&place).into_iter().flatten().flatten() {
                if let Some(waiters) = waiters.get_mut(wait.on) {
                    waiters.push(place);
                }
            }
        }
        while let Some(place) = open.pop() {
            if self.started(place) || !self.can_start(place) {
                continue;
            }
            if let Some(starts) = self.starts.get_mut(place) {
                *starts = true;
            }
            open.extend(children.get(place).into_iter().flatten());
            open.extend(waiters.get(place).into_iter().flatten());
        }
    }

    fn started(&self, place: usize) -> bool {
        self.starts.get(place).copied().unwrap_or(true)
    }

    fn can_start(&self, place: usize) -> bool {
        let around = self.parent(place).is_none_or(|parent| self.started(parent));
        let free = |group: &Vec<Wait<'_, '_>>| group.iter().all(|wait| self.started(wait.on));
        around
            && self
                .triggers
                .get(&place)
                .is_none_or(|groups| groups.iter().any(free))
    }

    /// Returns the elements that wait for each other, cycle by cycle. Each comes with the condition
    /// by which it waits for the next. Elements that only wait for such a cycle are left out.
    pub(crate) fn cycles(&self) -> Vec<Vec<(usize, Element<'m, 'd>)>> {
        let mut seen: Vec<usize> = vec![0; self.elements.len()];
        let mut cycles = Vec::new();
        for start in 0..self.elements.len() {
            let mut way: Vec<(usize, Element<'m, 'd>)> = Vec::new();
            let mut at = self.held(start);
            while let Some((place, condition, next)) = at {
                match seen.get_mut(place) {
                    Some(round) if *round == 0 => *round = start + 1,
                    Some(round) => {
                        if *round == start + 1 {
                            let from = way.iter().position(|(one, _)| *one == place);
                            cycles.push(way.split_off(from.unwrap_or(0)));
                        }
                        break;
                    }
                    None => break,
                }
                way.push((place, condition));
                at = self.held(next);
            }
        }
        cycles
    }

    /// Returns the outermost element at or around `place` that its own trigger blocks. It comes
    /// with the first blocking condition and the element that this condition waits for.
    fn held(&self, place: usize) -> Option<(usize, Element<'m, 'd>, usize)> {
        if self.started(place) {
            return None;
        }
        let around = std::iter::successors(Some(place), |place| self.parent(*place));
        let outermost = around
            .into_iter()
            .filter(|one| !self.started(*one))
            .last()?;
        let mut waits = self
            .triggers
            .get(&outermost)
            .into_iter()
            .flatten()
            .flatten();
        let wait = waits.find(|wait| !self.started(wait.on))?;
        Some((outermost, wait.condition, wait.on))
    }
}

/// Returns the indices of the storyboard's elements by the offset of their node.
fn places(scenario: &Scenario<'_>) -> HashMap<u64, Vec<usize>> {
    let mut places: HashMap<u64, Vec<usize>> = HashMap::new();
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        let offset = one.element(scenario).node().offset();
        places.entry(offset.into()).or_default().push(place);
    }
    places
}
