//! The storyboard is played: bounds for the start and the end of each element.
//!
//! Bounds are found in turns. The earliest times grow from "never": an element can start only when
//! something else has started it. With these, the latest times shrink from "never": an element
//! surely starts if its trigger surely becomes true. Both are repeated while they improve.

use super::condition::Known;
use super::moment::{Moment, Times};
use super::plan::{
    Condition, Edge, Logic, Plan, Priority, Start, State, StoryPart, Takes, Tree, Trigger,
};
use crate::types::storyboard::StoryKind;

/// How the standard is read where simulators differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strictness {
    /// As the standard says.
    Standard,
    /// As any known simulator does. What never happens here, happens nowhere.
    Tolerant,
}

/// When an element starts and ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// First start.
    pub start: Moment,
    /// First regular end.
    pub end: Moment,
    /// Moment from which it is complete, after a regular end, a stop or a skip.
    pub complete: Moment,
    /// First moment at which something stops it.
    pub stopped: Moment,
}

impl Span {
    const NEVER: Span = Span {
        start: Moment::NEVER,
        end: Moment::NEVER,
        complete: Moment::NEVER,
        stopped: Moment::NEVER,
    };
}

/// The spans of all elements, and the end of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Spans {
    spans: Vec<Span>,
    /// Moment of each act's own stop trigger; never for other elements.
    stops: Vec<Moment>,
    /// End of the run by the stop trigger of the storyboard.
    pub ends: Moment,
}

/// Simulators need up to two steps for a transition. Latest times are later by this many seconds.
pub(super) const STEP: f64 = 0.1;

/// Maximum number of rounds. Files need few, because elements mostly wait for earlier ones.
const MOST_ROUNDS: usize = 60;

/// Number of turns.
const TURNS: usize = 3;

impl Spans {
    /// Plays a storyboard.
    pub fn of(plan: &Plan, strictness: Strictness) -> Spans {
        let tree = &Tree::of(plan);
        let mut spans = Spans::never(plan.parts.len());
        for _ in 0..TURNS {
            let before = spans.clone();
            spans.forget_earliest();
            let settled = spans.settle(tree, strictness, Bound::Earliest)
                && spans.settle(tree, strictness, Bound::Latest);
            if !settled {
                return Spans::unknown(plan.parts.len());
            }
            if spans == before {
                break;
            }
        }
        spans
    }

    /// Returns the span of an element.
    pub fn get(&self, place: usize) -> Option<&Span> {
        self.spans.get(place)
    }

    /// Returns the first moment at which the act around an element, or the run, is stopped.
    pub(super) fn stop_of(&self, tree: &Tree<'_>, place: usize) -> Moment {
        self.enclosing_stop(tree, place).or(self.ends)
    }

    fn never(count: usize) -> Spans {
        Spans {
            spans: vec![Span::NEVER; count],
            stops: vec![Moment::NEVER; count],
            ends: Moment::NEVER,
        }
    }

    fn unknown(count: usize) -> Spans {
        let unknown = Span {
            start: Moment::UNKNOWN,
            end: Moment::UNKNOWN,
            complete: Moment::UNKNOWN,
            stopped: Moment::UNKNOWN,
        };
        Spans {
            spans: vec![unknown; count],
            stops: vec![Moment::UNKNOWN; count],
            ends: Moment::UNKNOWN,
        }
    }

    fn forget_earliest(&mut self) {
        let forget = |moment: &mut Moment| moment.earliest = f64::INFINITY;
        for span in &mut self.spans {
            forget(&mut span.start);
            forget(&mut span.end);
            forget(&mut span.complete);
            forget(&mut span.stopped);
        }
        self.stops.iter_mut().for_each(forget);
        forget(&mut self.ends);
    }

    /// Improves one bound until nothing changes. Returns `false` if that takes too long.
    fn settle(&mut self, tree: &Tree<'_>, strictness: Strictness, bound: Bound) -> bool {
        for _ in 0..MOST_ROUNDS {
            let mut changed = false;
            // Parents first for the starts, children first for the ends.
            for place in 0..tree.plan.parts.len() {
                changed |= self.start(tree, strictness, bound, place);
            }
            for place in (0..tree.plan.parts.len()).rev() {
                changed |= self.end(tree, strictness, bound, place);
            }
            changed |= self.run_ends(tree, strictness, bound);
            if !changed {
                return true;
            }
        }
        false
    }

    fn run_ends(&mut self, tree: &Tree<'_>, strictness: Strictness, bound: Bound) -> bool {
        let Some(stop) = &tree.plan.stop else {
            return false;
        };
        let ends = self
            .known(tree, strictness, None)
            .moment(stop, Moment::BEGIN);
        bound.set(&mut self.ends, ends)
    }

    fn known<'s>(
        &'s self,
        tree: &'s Tree<'s>,
        strictness: Strictness,
        waits: Option<usize>,
    ) -> Known<'s> {
        Known {
            tree,
            spans: self,
            strictness,
            waits,
        }
    }

    fn start(
        &mut self,
        tree: &Tree<'_>,
        strictness: Strictness,
        bound: Bound,
        place: usize,
    ) -> bool {
        let Some(part) = tree.plan.parts.get(place) else {
            return false;
        };
        let parent = match part.parent.and_then(|parent| self.spans.get(parent)) {
            Some(parent) => parent.start,
            None => Moment::BEGIN,
        };
        let start = match &part.start {
            Start::WithParent => parent,
            Start::Unknown => Moment {
                earliest: parent.earliest,
                ..Moment::UNKNOWN
            },
            Start::By(trigger) => {
                let known = self.known(tree, strictness, Some(place));
                let (may, by) =
                    match strictness == Strictness::Standard && part.priority == Priority::Skip {
                        true => known.trigger(&known.untied(place, trigger), parent),
                        false => known.trigger(trigger, parent),
                    };
                let stop = self.stop_of(tree, place);
                let until = Times::between(0.0, stop.latest);
                let mut may = may.intersect(&until);
                if strictness == Strictness::Standard && part.priority == Priority::Skip {
                    may = known.unless_others_run(place, may);
                }
                let sure = by + STEP <= stop.earliest && !known.may_be_skipped(place, part);
                Moment {
                    earliest: may.first(),
                    latest: if sure { by + STEP } else { f64::INFINITY },
                }
            }
        };
        let changed = match self.spans.get_mut(place) {
            Some(span) => bound.set(&mut span.start, start),
            None => false,
        };
        changed | self.act_stops(tree, strictness, bound, place)
    }

    fn act_stops(
        &mut self,
        tree: &Tree<'_>,
        strictness: Strictness,
        bound: Bound,
        place: usize,
    ) -> bool {
        let Some(trigger) = tree
            .plan
            .parts
            .get(place)
            .and_then(|part| part.stop.as_ref())
        else {
            return false;
        };
        let Some(started) = self.spans.get(place).map(|span| span.start) else {
            return false;
        };
        // An act that still waits may be stopped, too.
        let parent = tree
            .plan
            .parent(place)
            .and_then(|parent| self.spans.get(parent));
        let since = Moment {
            earliest: parent.map_or(0.0, |parent| parent.start.earliest),
            latest: started.latest,
        };
        let stops = self.known(tree, strictness, None).moment(trigger, since);
        match self.stops.get_mut(place) {
            Some(stop) => bound.set(stop, stops),
            None => false,
        }
    }

    /// Returns the moment at which the act around an element is stopped. The end of the run is not
    /// counted, because nothing happens after it.
    fn enclosing_stop(&self, tree: &Tree<'_>, place: usize) -> Moment {
        let stops = tree.plan.around(place).filter_map(|at| self.stops.get(at));
        stops.fold(Moment::NEVER, |first, stop| first.or(*stop))
    }

    fn end(&mut self, tree: &Tree<'_>, strictness: Strictness, bound: Bound, place: usize) -> bool {
        let (Some(part), Some(span)) = (tree.plan.parts.get(place), self.spans.get(place).copied())
        else {
            return false;
        };
        let stopped = self.stopped(tree, place, part);
        let by_itself = match part.kind {
            StoryKind::Action => takes(span.start, part.takes, strictness),
            _ => self.children_complete(tree, place, span.start),
        };
        // A stop comes before the regular end, or may.
        let end = Moment {
            earliest: by_itself
                .earliest
                .min(ended_by_stop(stopped, part.kind, strictness)),
            latest: match by_itself.latest <= stopped.or(self.ends).earliest {
                true => by_itself.latest,
                false => f64::INFINITY,
            },
        };
        let regular = self.complete(tree, strictness, place, part, by_itself);
        let mut stop = self.enclosing_stop(tree, place);
        let event = part.parent.filter(|_| part.kind == StoryKind::Action);
        let known = self.known(tree, strictness, None);
        let is_skipped = event.is_some_and(|event| {
            let event_part = tree.plan.parts.get(event);
            event_part.is_some_and(|it| known.may_be_skipped(event, it))
        });
        if is_skipped || self.may_be_idle(tree, strictness, place, stop) {
            // The actions of a skipped event never ran and are not stopped.
            stop.latest = f64::INFINITY;
        }
        let complete = regular.or(stop).or(Moment {
            earliest: stopped.earliest,
            latest: f64::INFINITY,
        });
        let Some(span) = self.spans.get_mut(place) else {
            return false;
        };
        bound.set(&mut span.end, end)
            | bound.set(&mut span.complete, complete)
            | bound.set(&mut span.stopped, stopped)
    }

    /// Checks whether an element may wait for its parent when its act is stopped. Some simulators
    /// never complete it then.
    fn may_be_idle(
        &self,
        tree: &Tree<'_>,
        strictness: Strictness,
        place: usize,
        stop: Moment,
    ) -> bool {
        let waits = tree.plan.parts.get(place);
        let waits = waits.is_some_and(|part| matches!(part.start, Start::By(_)));
        let awake = if waits {
            tree.plan.parent(place)
        } else {
            Some(place)
        };
        let awake = awake.map_or(Moment::BEGIN, |at| {
            self.spans.get(at).map_or(Moment::UNKNOWN, |it| it.start)
        });
        strictness == Strictness::Tolerant && awake.latest > stop.earliest
    }

    /// Returns when something stops an element: the end of its act, an event that overrides, or an
    /// action that controls the same thing.
    fn stopped(&self, tree: &Tree<'_>, place: usize, part: &StoryPart) -> Moment {
        let started = self.spans.get(place).map_or(0.0, |it| it.start.earliest);
        let may_start = |other: usize| {
            let span = self.spans.get(other)?;
            let is_over = span.start.latest < started && !tree.plan.repeats(other);
            (!is_over).then_some(Moment {
                earliest: span.start.earliest.max(started),
                latest: f64::INFINITY,
            })
        };
        let mut first = self.enclosing_stop(tree, place);
        let event = match part.kind {
            StoryKind::Event => Some(place),
            StoryKind::Action => part.parent,
            _ => None,
        };
        let overriding = event.into_iter().flat_map(|event| tree.overriding(event));
        for moment in overriding.filter_map(may_start) {
            first = first.or(moment);
        }
        if part.is_open {
            first.earliest = first.earliest.min(started);
        }
        let rivals = part.rivals.iter().filter_map(|rival| may_start(*rival));
        rivals.fold(first, Moment::or)
    }

    fn children_complete(&self, tree: &Tree<'_>, place: usize, start: Moment) -> Moment {
        let Some((first, others)) = tree.children(place).split_first() else {
            // Simulators treat empty elements in different ways.
            return Moment {
                earliest: start.earliest,
                latest: f64::INFINITY,
            };
        };
        let complete = |at: usize| self.spans.get(at).map_or(Moment::UNKNOWN, |it| it.complete);
        let others = others.iter().map(|at| complete(*at));
        let all = others.fold(complete(*first), Moment::and);
        later(all.and(start), STEP)
    }

    /// Returns when an element is complete without being stopped, after all its executions.
    fn complete(
        &self,
        tree: &Tree<'_>,
        strictness: Strictness,
        place: usize,
        part: &StoryPart,
        by_itself: Moment,
    ) -> Moment {
        let known = self.known(tree, strictness, None);
        let repeated = match part.executions {
            Some(1) => by_itself,
            _ => Moment {
                earliest: by_itself.earliest,
                latest: f64::INFINITY,
            },
        };
        let Some(most) = part.executions.filter(|_| part.kind == StoryKind::Event) else {
            return repeated;
        };
        let is_short = match &part.start {
            Start::By(trigger) if !tree.plan.is_looped(place) => {
                known.occurrences(trigger).is_some_and(|it| it < most)
            }
            _ => false,
        };
        let skipped = Moment {
            earliest: known.skipped_at(place, part),
            latest: f64::INFINITY,
        };
        if is_short {
            return skipped;
        }
        repeated.or(skipped)
    }
}

impl Known<'_> {
    /// Returns when a trigger is first true, if it is looked at from `since` on.
    fn moment(&self, trigger: &Trigger, since: Moment) -> Moment {
        let (may, by) = self.trigger(trigger, since);
        Moment {
            earliest: may.first(),
            latest: by + STEP,
        }
    }

    /// Removes the times at which another event of the maneuver certainly runs.
    fn unless_others_run(&self, place: usize, may: Times) -> Times {
        self.tree.siblings(place).fold(may, |may, other| {
            let Some(span) = self.spans.get(other) else {
                return may;
            };
            let until = span.end.earliest.min(span.complete.earliest);
            may.without(&Times::between(span.start.latest, until), true, true)
        })
    }

    /// Returns the trigger of an event without the groups that are true only while another event
    /// of the maneuver runs.
    fn untied(&self, place: usize, trigger: &Trigger) -> Trigger {
        let groups = trigger.groups.iter();
        let free = groups.filter(|group| self.tied_to(place, group).is_none());
        Trigger {
            groups: free.cloned().collect(),
        }
    }

    /// Returns the other event of the maneuver that runs whenever a group is true.
    pub(super) fn tied_to(&self, place: usize, group: &[Condition]) -> Option<usize> {
        group.iter().find_map(|condition| match condition {
            Condition {
                logic: Logic::State(of, State::Running),
                edge: Edge::None | Edge::Rising,
                delay: Some(0.0),
                is_certain: true,
            } => {
                let is_beside = self.tree.siblings(place).any(|other| other == *of);
                // An event that is stopped may end in this very step.
                let runs_on = self.spans.get(*of)?.stopped.is_never();
                (is_beside && runs_on).then_some(*of)
            }
            _ => None,
        })
    }

    fn may_be_skipped(&self, place: usize, part: &StoryPart) -> bool {
        matches!(part.priority, Priority::Skip | Priority::Unknown)
            && self.tree.siblings(place).next().is_some()
    }

    fn skipped_at(&self, place: usize, part: &StoryPart) -> f64 {
        if !self.may_be_skipped(place, part) {
            return f64::INFINITY;
        }
        let parent = part.parent.and_then(|parent| self.spans.get(parent));
        parent.map_or(0.0, |parent| parent.start.earliest)
    }
}

/// Returns when an action ends by itself.
fn takes(start: Moment, takes: Takes, strictness: Strictness) -> Moment {
    let ends = |least: f64, most: f64| Moment {
        earliest: start.earliest + least,
        latest: start.latest + most + STEP,
    };
    match (takes, strictness) {
        (Takes::NoTime, _) => ends(0.0, 0.0),
        (Takes::Seconds(time), Strictness::Standard) => ends(time, time),
        // Who is already there may end at once.
        (Takes::Seconds(time), Strictness::Tolerant) => ends(0.0, time),
        (Takes::Forever, _) | (Takes::ForeverInTheory, Strictness::Standard) => Moment::NEVER,
        (Takes::ForeverInTheory, Strictness::Tolerant) | (Takes::Unknown, _) => {
            ends(0.0, f64::INFINITY)
        }
    }
}

/// Returns the earliest time at which a stop ends an element regularly, or infinity. Some simulators
/// end actions that another action or an event with the priority `override` stops.
fn ended_by_stop(stopped: Moment, kind: StoryKind, strictness: Strictness) -> f64 {
    match (kind, strictness) {
        (StoryKind::Action, Strictness::Tolerant) => stopped.earliest,
        _ => f64::INFINITY,
    }
}

fn later(moment: Moment, seconds: f64) -> Moment {
    Moment {
        latest: moment.latest + seconds,
        ..moment
    }
}

/// The bound that is improved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bound {
    Earliest,
    Latest,
}

impl Bound {
    /// Improves a bound. Returns whether it changed.
    fn set(self, moment: &mut Moment, found: Moment) -> bool {
        let (old, new) = match self {
            Bound::Earliest => (&mut moment.earliest, found.earliest),
            Bound::Latest => (&mut moment.latest, found.latest.max(found.earliest)),
        };
        let better = new < *old;
        if better {
            *old = new;
        }
        better
    }
}
