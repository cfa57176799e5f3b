//! When conditions and triggers are true.

use super::moment::{Moment, Times};
use super::plan::{Comparison, Condition, Edge, Logic, Priority, State, Tree, Trigger};
use super::play::{STEP, Spans, Strictness};
use crate::types::storyboard::StoryKind;

/// A time just after another. `greaterThan` becomes true there.
const JUST_AFTER: f64 = 1e-6;

/// Times at which a condition may or must be true.
#[derive(Debug, Clone)]
pub(super) struct Truth {
    /// It is false at all other times.
    pub(super) may: Times,
    /// It is true at all of these times.
    pub(super) must: Times,
    /// It is true at least once in this interval.
    pub(super) once: Option<(f64, f64)>,
    /// Whether that is certainly seen, even if the interval begins before the first look.
    pub(super) is_seen: bool,
}

impl Truth {
    fn level(may: Times, must: Times) -> Truth {
        Truth {
            may,
            must,
            once: None,
            is_seen: false,
        }
    }

    fn pulse(may: Times, once: Moment) -> Truth {
        Truth {
            may,
            must: Times::none(),
            once: once.is_certain().then_some((once.earliest, once.latest)),
            is_seen: false,
        }
    }

    fn unknown() -> Truth {
        Truth::level(Times::always(), Times::none())
    }

    fn never() -> Truth {
        Truth::level(Times::none(), Times::none())
    }
}

/// What is known while conditions are evaluated.
pub(super) struct Known<'p> {
    pub(super) tree: &'p Tree<'p>,
    pub(super) spans: &'p Spans,
    pub(super) strictness: Strictness,
    /// The element whose trigger is evaluated; `None` for the run.
    pub(super) waits: Option<usize>,
}

impl Known<'_> {
    /// Returns the times at which a condition may and must be true, if it is looked at from `since`
    /// on.
    pub(super) fn condition(&self, condition: &Condition, since: Moment) -> Truth {
        let plain = match condition.is_certain || self.strictness == Strictness::Standard {
            true => self.logic(&condition.logic),
            false => Truth::unknown(),
        };
        // A delayed condition may look at what was before it was first looked at.
        let earlier = Moment {
            earliest: (since.earliest - condition.delay.unwrap_or(since.earliest)).max(0.0),
            latest: since.latest,
        };
        let edged = match self.is_own_start(&condition.logic) {
            true => self.own_start(plain, condition.edge, since),
            false => self.edge(plain, condition.edge, earlier),
        };
        let Some(delay) = condition.delay else {
            // Not before the expression itself is true.
            let first = edged.may.first();
            return Truth::level(Times::from(first), Times::none());
        };
        // The delay may begin when the condition is first looked at.
        let must = edged.must.intersect(&Times::from(since.latest));
        Truth {
            may: edged.may.later(delay),
            must: must.later(delay),
            once: edged
                .once
                .filter(|(from, _)| edged.is_seen || *from > since.latest)
                .map(|(from, to)| (from + delay, to + delay)),
            is_seen: edged.is_seen,
        }
    }

    /// Checks whether an expression is about the start of an element around the one that waits.
    /// That element waits from this very start on (8.4).
    fn is_own_start(&self, logic: &Logic) -> bool {
        let (Logic::State(of, State::StartTransition), Some(waits)) = (logic, self.waits) else {
            return false;
        };
        let mut around = self.tree.plan.around(waits).skip(1);
        let parent = self.tree.plan.parent(waits);
        let start = |place: usize| self.spans.get(place).map(|span| span.start);
        // An act waits for its story, but not for the start of the act before.
        around.any(|at| at == *of)
            && parent.and_then(start) == start(*of)
            && !self.tree.plan.is_looped(*of)
    }

    /// Returns when a condition about the start of an element around the one that waits is true.
    /// The first look sees the transition, and every later look comes after it. At the first look
    /// there is no earlier value, so nothing rises (7.6).
    fn own_start(&self, truth: Truth, edge: Edge, since: Moment) -> Truth {
        let (may, later) = match (edge, self.strictness) {
            (Edge::None, _) => (truth.may, STEP),
            (Edge::Rising, Strictness::Standard) => return Truth::never(),
            (Edge::Falling | Edge::RisingOrFalling, Strictness::Standard) => {
                // It falls after the first look.
                let later = Times::from(since.earliest + JUST_AFTER / 2.0);
                (truth.may.longer(STEP).meet(&later), 2.0 * STEP)
            }
            _ => return self.edge(truth, edge, since),
        };
        let once = since
            .is_certain()
            .then_some((since.earliest, since.latest + later));
        Truth {
            may,
            must: Times::none(),
            once,
            is_seen: once.is_some(),
        }
    }

    fn logic(&self, logic: &Logic) -> Truth {
        match logic {
            Logic::Time(comparison, value) => {
                let times = time(*comparison, *value);
                let is_moment = *comparison == Comparison::EqualTo;
                // A step may miss a single moment.
                let must = if is_moment {
                    Times::none()
                } else {
                    times.clone()
                };
                Truth::level(times, must)
            }
            Logic::State(place, state) => {
                let truth = self.state(*place, *state);
                let may = match self.strictness {
                    // A condition sees the state of this step or of the step before.
                    Strictness::Standard => truth.may.longer(STEP),
                    // Some simulators keep every change until the condition is looked at.
                    Strictness::Tolerant => Times::from(truth.may.first()),
                };
                Truth {
                    may,
                    must: truth.must.shorter(STEP),
                    once: truth.once.map(|(from, to)| (from, to + STEP)),
                    is_seen: false,
                }
            }
            Logic::Never => Truth::never(),
            Logic::Unknown => Truth::unknown(),
        }
    }

    fn state(&self, place: usize, state: State) -> Truth {
        let Some(span) = self.spans.get(place) else {
            return Truth::unknown();
        };
        let repeats = self.tree.plan.repeats(place);
        let last = |once: f64| self.last(place, once);
        match state {
            State::Standby => self.standby(place),
            State::Running => {
                let ends = if repeats { span.end } else { span.complete };
                let until = ends.earliest.min(span.complete.earliest);
                Truth::level(
                    Times::between(span.start.earliest, last(span.complete.latest)),
                    Times::between(span.start.latest, until),
                )
            }
            State::Complete => {
                let must = match self.tree.plan.is_looped(place) {
                    true => Times::none(),
                    false => Times::from(span.complete.latest),
                };
                Truth::level(Times::from(span.complete.earliest), must)
            }
            State::StartTransition => Truth::pulse(
                Times::between(span.start.earliest, last(span.start.latest)),
                span.start,
            ),
            State::EndTransition => Truth::pulse(
                Times::between(span.end.earliest, last(span.end.latest)),
                span.end,
            ),
            State::StopTransition => {
                Truth::level(Times::from(span.stopped.earliest), Times::none())
            }
            State::SkipTransition => Truth::level(Times::from(self.skipped(place)), Times::none()),
        }
    }

    /// Returns the latest time of something that happens at `once` in each execution.
    fn last(&self, place: usize, once: f64) -> f64 {
        if self.tree.plan.is_looped(place) {
            return f64::INFINITY;
        }
        match self.tree.plan.repeated_event(place) {
            Some(event) => {
                let event = self.spans.get(event);
                event.map_or(f64::INFINITY, |it| it.complete.latest)
            }
            None => once,
        }
    }

    fn standby(&self, place: usize) -> Truth {
        let (Some(span), Some(part)) = (self.spans.get(place), self.tree.plan.parts.get(place))
        else {
            return Truth::unknown();
        };
        let until = self.last(place, span.start.latest);
        let waits = matches!(part.start, super::plan::Start::By(_));
        let parent = part.parent.and_then(|parent| self.spans.get(parent));
        let since = parent.map_or(0.0, |parent| parent.start.latest);
        let ends = span.start.earliest.min(span.complete.earliest);
        let must = match waits {
            true => Times::between(since, ends),
            false => Times::none(),
        };
        Truth::level(Times::between(0.0, until), must)
    }

    /// Returns the earliest time at which an event can be skipped, or infinity. Only events of
    /// priority `skip` are, and only if another event of their maneuver can run.
    fn skipped(&self, place: usize) -> f64 {
        let Some(part) = self.tree.plan.parts.get(place) else {
            return 0.0;
        };
        let is_known = matches!(part.priority, Priority::Parallel | Priority::Override);
        if part.kind != StoryKind::Event || is_known {
            return f64::INFINITY;
        }
        let others = self.tree.siblings(place);
        let running = others.filter_map(|other| Some(self.spans.get(other)?.start.earliest));
        running.fold(f64::INFINITY, f64::min)
    }

    fn edge(&self, truth: Truth, edge: Edge, since: Moment) -> Truth {
        let (begins, ends) = match edge {
            Edge::None => return truth,
            Edge::Rising => (true, false),
            Edge::Falling => (false, true),
            Edge::RisingOrFalling => (true, true),
            Edge::Unknown => return Truth::level(truth.may, Times::none()),
        };
        let Truth {
            may, must, once, ..
        } = truth;
        // What lasts for one step falls in the next one.
        let may = if ends { may.longer(STEP) } else { may };
        let changes = may.without(&must, begins, ends);
        let rise = match (edge, once) {
            (Edge::Falling, _) => None,
            // A transition is false in the step before.
            (_, Some(pulse)) => Some(pulse),
            (_, None) => rise(&may, &must),
        };
        // The first look has no earlier one to compare with. Some simulators take it as false.
        let seen = match self.strictness {
            Strictness::Standard => Times::from(since.earliest + JUST_AFTER / 2.0),
            Strictness::Tolerant => Times::from(since.earliest),
        };
        let mut changes = changes.intersect(&seen);
        if self.strictness == Strictness::Tolerant && begins {
            // What is true at the first look, rises there.
            let first = Times::between(since.earliest, since.latest);
            changes = changes.unite(&may.intersect(&first));
        }
        Truth {
            may: changes,
            must: Times::none(),
            once: rise.filter(|(from, _)| *from > since.latest),
            is_seen: false,
        }
    }

    /// Returns the times at which a group may be true, and a time by which it surely was.
    pub(super) fn group(&self, group: &[Condition], since: Moment) -> (Times, f64) {
        let truths: Vec<Truth> = group
            .iter()
            .map(|condition| self.condition(condition, since))
            .collect();
        let looked = Times::from(since.earliest);
        let may = truths
            .iter()
            .fold(looked, |may, truth| may.meet(&truth.may));
        let looked = Times::from(since.latest);
        let must = truths
            .iter()
            .fold(looked, |must, truth| must.intersect(&truth.must));
        // A step may miss what is true for less than a step.
        let mut by = must.first_lasting(STEP);
        for (at, truth) in truths.iter().enumerate() {
            let is_seen = |from: f64| truth.is_seen || from > since.latest;
            let Some((from, to)) = truth.once.filter(|(from, _)| is_seen(*from)) else {
                continue;
            };
            let mut others = truths.iter().enumerate().filter(|(other, _)| *other != at);
            let looked = group.get(at).map_or(from, |it| self.looked_at(it, from));
            let since = |other: usize| if other < at { looked } else { from };
            if others.all(|(other, truth)| truth.must.covers(since(other), to + STEP)) {
                by = by.min(to);
            }
        }
        (may, by)
    }

    /// Returns the time from which a condition is looked at for an edge at `from`. Some simulators
    /// look at a condition without delay only while those before it in its group are true.
    fn looked_at(&self, condition: &Condition, from: f64) -> f64 {
        match (self.strictness, condition.delay) {
            (Strictness::Tolerant, None | Some(0.0)) => (from - STEP).max(0.0),
            _ => from,
        }
    }

    /// Returns the times at which a trigger may be true, and a time by which it surely was.
    pub(super) fn trigger(&self, trigger: &Trigger, since: Moment) -> (Times, f64) {
        let mut all = (Times::none(), f64::INFINITY);
        if since.is_never() {
            return all;
        }
        for group in &trigger.groups {
            let (may, by) = self.group(group, since);
            all = (all.0.unite(&may), all.1.min(by));
        }
        all
    }

    /// Returns how often a trigger can become true; `None` if nothing limits it.
    pub(super) fn occurrences(&self, trigger: &Trigger) -> Option<u32> {
        trigger.groups.iter().try_fold(0_u32, |sum, group| {
            let limits = group.iter().filter_map(|condition| self.times(condition));
            Some(sum.saturating_add(limits.min()?))
        })
    }

    fn times(&self, condition: &Condition) -> Option<u32> {
        if !condition.is_certain && self.strictness == Strictness::Tolerant {
            return None;
        }
        let both = |once: u32| match condition.edge {
            Edge::RisingOrFalling | Edge::Unknown => once.saturating_mul(2),
            _ => once,
        };
        match &condition.logic {
            Logic::Never => Some(0),
            Logic::Time(Comparison::EqualTo, _) => Some(both(1)),
            Logic::Time(Comparison::NotEqualTo, _) | Logic::Unknown => None,
            Logic::Time(..) => (condition.edge != Edge::None).then_some(1),
            Logic::State(place, state) => {
                if self.tree.plan.repeats(*place) {
                    return None;
                }
                let lasts = matches!(state, State::Standby | State::Running | State::Complete);
                (!lasts || condition.edge != Edge::None).then_some(both(1))
            }
        }
    }
}

/// Returns the bounds between which an expression surely becomes true.
fn rise(may: &Times, must: &Times) -> Option<(f64, f64)> {
    let (from, to) = (may.first(), must.first());
    (from > 0.0 && to < f64::INFINITY && may.covers(from, to)).then_some((from, to))
}

/// Returns the times at which a comparison with the simulation time is true.
fn time(comparison: Comparison, value: f64) -> Times {
    let never = f64::INFINITY;
    let after = value + JUST_AFTER;
    match comparison {
        Comparison::EqualTo => Times::between((value - STEP).max(0.0), value + STEP),
        Comparison::GreaterThan => Times::from(after.max(0.0)),
        Comparison::GreaterOrEqual => Times::from(value.max(0.0)),
        Comparison::LessThan if value <= 0.0 => Times::none(),
        Comparison::LessThan | Comparison::LessOrEqual => Times::between(0.0, value),
        Comparison::NotEqualTo if value < 0.0 => Times::always(),
        Comparison::NotEqualTo => Times::between(0.0, value).unite(&Times::between(after, never)),
    }
}
