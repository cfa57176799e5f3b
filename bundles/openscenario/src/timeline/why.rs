//! Why an element never starts, or the run never ends.

use super::condition::Known;
use super::moment::{Moment, Times};
use super::plan::{Condition, Logic, Plan, Priority, Start, Tree, Trigger};
use super::play::{Spans, Strictness};

/// Position of a condition in its trigger: group and condition.
pub type At = (usize, usize);

/// Why a condition group is never true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The state of an element never comes.
    StateNeverComes {
        /// The condition.
        at: At,
        /// Index of the element.
        of: usize,
    },
    /// The scenario itself makes the condition impossible.
    Impossible {
        /// The condition.
        at: At,
    },
    /// The condition, or its edge, is over before it is first looked at.
    Over {
        /// The condition.
        at: At,
    },
    /// Two conditions are never true at the same time.
    Apart {
        /// One condition.
        one: At,
        /// The other.
        other: At,
    },
    /// The group is first true after the act or the run has ended.
    AfterTheEnd {
        /// First time at which it may be true, in seconds.
        first: f64,
    },
    /// Another event of the maneuver runs whenever the event is triggered.
    Skipped {
        /// Index of the other event.
        by: usize,
    },
}

/// Returns the causes, one for each condition group, why an element never starts. The list is empty
/// if it may start, or if only its parent never starts.
pub(super) fn never_starts(
    plan: &Plan,
    spans: &Spans,
    strictness: Strictness,
    place: usize,
) -> Vec<Cause> {
    let (Some(part), Some(span)) = (plan.parts.get(place), spans.get(place)) else {
        return Vec::new();
    };
    let since = match part.parent.and_then(|parent| spans.get(parent)) {
        Some(parent) => parent.start,
        None => Moment::BEGIN,
    };
    let Start::By(trigger) = &part.start else {
        return Vec::new();
    };
    if !span.start.is_never() || since.is_never() {
        return Vec::new();
    }
    let tree = Tree::of(plan);
    let known = Known {
        tree: &tree,
        spans,
        strictness,
        waits: Some(place),
    };
    let until = spans.stop_of(&tree, place).latest;
    let groups = trigger.groups.iter().enumerate();
    groups
        .map(|(number, group)| match known.cause(number, group, since) {
            Some(cause) => cause,
            None => known.late_or_skipped(group, since, until, place, part.priority),
        })
        .collect()
}

/// Returns the causes, one for each condition group, why the run never ends.
pub(super) fn never_ends(plan: &Plan, spans: &Spans, strictness: Strictness) -> Vec<Cause> {
    let Some(Trigger { groups }) = plan.stop.as_ref().filter(|_| spans.ends.is_never()) else {
        return Vec::new();
    };
    let tree = Tree::of(plan);
    let known = Known {
        tree: &tree,
        spans,
        strictness,
        waits: None,
    };
    let groups = groups.iter().enumerate();
    groups
        .filter_map(|(number, group)| known.cause(number, group, Moment::BEGIN))
        .collect()
}

impl Known<'_> {
    /// Returns why a group is never true while it is looked at.
    fn cause(&self, number: usize, group: &[Condition], since: Moment) -> Option<Cause> {
        let looked = Times::from(since.earliest);
        let mut seen: Vec<Times> = Vec::with_capacity(group.len());
        for (index, condition) in group.iter().enumerate() {
            let at = (number, index);
            let may = self.condition(condition, since).may.meet(&looked);
            if may.is_empty() {
                return Some(self.cause_of(at, condition));
            }
            seen.push(may);
        }
        for (other, times) in seen.iter().enumerate() {
            let before = seen.iter().take(other);
            for (one, earlier) in before.enumerate() {
                if earlier.meet(times).is_empty() {
                    return Some(Cause::Apart {
                        one: (number, one),
                        other: (number, other),
                    });
                }
            }
        }
        None
    }

    fn cause_of(&self, at: At, condition: &Condition) -> Cause {
        let plain = Condition {
            edge: super::plan::Edge::None,
            delay: Some(0.0),
            ..condition.clone()
        };
        let is_possible = !self.condition(&plain, Moment::BEGIN).may.is_empty();
        match condition.logic {
            _ if is_possible => Cause::Over { at },
            Logic::State(of, _) => Cause::StateNeverComes { at, of },
            _ => Cause::Impossible { at },
        }
    }

    fn late_or_skipped(
        &self,
        group: &[Condition],
        since: Moment,
        until: f64,
        place: usize,
        priority: Priority,
    ) -> Cause {
        let (may, _) = self.group(group, since);
        let in_time = may.intersect(&Times::between(0.0, until));
        let late = Cause::AfterTheEnd { first: may.first() };
        if in_time.is_empty() || priority != Priority::Skip {
            return late;
        }
        if let Some(by) = self.tied_to(place, group) {
            return Cause::Skipped { by };
        }
        let first = in_time.first();
        let runs = |other: &usize| {
            let span = self.spans.get(*other);
            span.is_some_and(|it| it.start.latest <= first && it.complete.earliest >= first)
        };
        match self.tree.siblings(place).find(runs) {
            Some(by) => Cause::Skipped { by },
            None => late,
        }
    }
}
