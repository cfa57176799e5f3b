//! Tasks of a strand, and the threads that take them.
//!
//! A task is a part of the model, at which all checkers that go by parts look in turn, or the whole of
//! it, at which one checker looks. Every thread has sinks of its own for what its tasks find. What one
//! thread alone would have listed is put together from them: findings in the order of their parts. Where
//! that cannot be told from the sinks (a checker found more than it lists, or counts references) it looks
//! once more, alone: rules give the same answer every time.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::{Duration, Instant};

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Issue;

use super::gates::Pass;
use super::{Outcome, Work, catch};
use crate::permits::Permit;
use crate::rule::{Built, Facts};
use crate::sink::WHOLE;
use crate::{AnyRule, Sink};

/// A checker that may look.
pub(super) struct ScheduledRule<'r> {
    pub index: usize,
    pub rule: &'static dyn AnyRule,
    pub facts: &'r Facts,
    pub pass: Pass<'r>,
}

/// What a checker found, and how it ended.
type Looked = (Vec<Issue>, Outcome);

/// What one thread has of one checker.
struct Had<'r> {
    sink: Sink<'r>,
    took: Duration,
    /// Where it failed or said that it has ended, and how; it is not asked again.
    ended: Option<(u32, Ending)>,
}

/// The tasks, and which of them is next.
struct Tasks<'t, 'r> {
    work: Work<'r>,
    schedule: &'t [ScheduledRule<'r>],
    /// By place in `schedule`: those that go by parts.
    by_parts: Vec<usize>,
    /// Those that look at the whole only. The others do so after the parts, and may ask what was found in them.
    wholes: Vec<usize>,
    built: &'t dyn Built<'r>,
    next: AtomicUsize,
}

/// How long a thread has been at tasks before it asks others: a few that are soon done are not worth it.
/// Starting a thread takes a tenth of a millisecond.
const WORTH_A_THREAD: Duration = Duration::from_micros(100);

/// What one thread has found, by place in the turns.
type Pile<'r> = Vec<Option<Had<'r>>>;

impl<'r> Work<'r> {
    /// Has checkers look at the parts of the model and at the whole: what they say, in their order. `None`
    /// when the check was cancelled.
    pub(super) fn look(
        self,
        schedule: &[ScheduledRule<'r>],
        built: &dyn Built<'r>,
    ) -> Option<Vec<Looked>> {
        let places = |asked: fn(&dyn AnyRule) -> bool| {
            let all = schedule.iter().enumerate();
            let asked = all.filter(|(_, scheduled)| asked(scheduled.rule));
            asked.map(|(place, _)| place).collect::<Vec<usize>>()
        };
        let tasks = Tasks {
            work: self,
            schedule,
            by_parts: places(|rule| rule.goes_by_parts()),
            wholes: places(|rule| !rule.goes_by_parts()),
            built,
            next: AtomicUsize::new(0),
        };
        let mut piles = if self.spreads {
            tasks.by_many()
        } else {
            let mut own = tasks.empty_pile();
            while tasks.one(&mut own) {}
            vec![own]
        };
        if self.stops() {
            return None;
        }
        let of = |place: usize| {
            let of_all = piles.iter_mut();
            let found = of_all.filter_map(|it| it.get_mut(place)?.take()).collect();
            tasks.together(&schedule[place], found)
        };
        Some((0..schedule.len()).map(of).collect())
    }
}

impl<'r> Tasks<'_, 'r> {
    /// Takes tasks in this thread, and has others take some as long as there are hands to spare.
    fn by_many(&self) -> Vec<Pile<'r>> {
        let begun = Instant::now();
        std::thread::scope(|scope| {
            let mut others = Vec::new();
            let mut own = self.empty_pile();
            loop {
                while self.left() > 1
                    && begun.elapsed() >= WORTH_A_THREAD
                    && let Some(permit) = self.work.permits.spare()
                {
                    others.extend(beside(scope, move || self.lend(permit)));
                }
                if !self.one(&mut own) {
                    break;
                }
            }
            let mut piles = vec![own];
            let end = || piles.extend(others.into_iter().map(joined));
            self.work.permits.wait_for(end);
            piles
        })
    }

    /// Takes tasks with a hand that is lent: until a job wants it.
    fn lend(&self, permit: Permit<'_>) -> Pile<'r> {
        let mut own = self.empty_pile();
        while !self.work.permits.are_wanted() && self.one(&mut own) {}
        drop(permit);
        own
    }

    fn empty_pile(&self) -> Pile<'r> {
        self.schedule.iter().map(|_| None).collect()
    }

    fn count(&self) -> usize {
        self.built.parts() + self.wholes.len()
    }

    /// How many tasks nobody has taken.
    fn left(&self) -> usize {
        self.count()
            .saturating_sub(self.next.load(Ordering::Relaxed))
    }

    /// Takes one task. `false`: there is none.
    fn one(&self, own: &mut Pile<'r>) -> bool {
        if self.work.stops() {
            return false;
        }
        let task = self.next.fetch_add(1, Ordering::Relaxed);
        let parts = self.built.parts();
        if task < parts {
            let mut clock = Instant::now();
            for &place in &self.by_parts {
                let (scheduled, had) = self.in_pile(own, place);
                self.look(scheduled, had, Some(task), &mut clock);
            }
        } else if let Some(&place) = self.wholes.get(task - parts) {
            let (scheduled, had) = self.in_pile(own, place);
            self.look(scheduled, had, None, &mut Instant::now());
        }
        task < self.count()
    }

    /// A checker and what this thread has of it.
    fn in_pile<'p>(
        &self,
        pile: &'p mut Pile<'r>,
        place: usize,
    ) -> (&ScheduledRule<'r>, &'p mut Had<'r>) {
        let scheduled = &self.schedule[place];
        let had = pile[place].get_or_insert_with(|| self.nothing_yet(scheduled));
        (scheduled, had)
    }

    /// Has a checker look at a part, or at the whole (`None`). `clock` is when that began, and then when it
    /// ended.
    fn look(
        &self,
        scheduled: &ScheduledRule<'r>,
        had: &mut Had<'r>,
        part: Option<usize>,
        clock: &mut Instant,
    ) {
        if had.ended.is_some() {
            return;
        }
        self.work.listener.begins(scheduled.index);
        let number = part.map_or(WHOLE, |part| u32::try_from(part).unwrap_or(WHOLE));
        had.sink.turn_to(number);
        let sink = &mut had.sink;
        let looked = catch(|| match part {
            None => self.built.run(scheduled.rule, sink),
            Some(part) => self.built.each(part, scheduled.rule, sink),
        });
        let ending = match looked {
            Ok(()) => had.sink.take_ending(),
            Err(panic) => Some(Ending::Failed {
                reason: format!("the rule panicked: {panic}"),
            }),
        };
        had.ended = ending.map(|ending| (number, ending));
        let now = Instant::now();
        had.took += now.duration_since(*clock);
        *clock = now;
    }

    fn nothing_yet(&self, scheduled: &ScheduledRule<'r>) -> Had<'r> {
        let Pass {
            values,
            not_normative,
        } = &scheduled.pass;
        Had {
            sink: Sink::new(
                self.work.subject,
                scheduled.facts,
                values,
                not_normative.clone(),
            ),
            took: Duration::ZERO,
            ended: None,
        }
    }

    /// What a checker says, of which several threads may have something.
    fn together(&self, scheduled: &ScheduledRule<'r>, mut found: Vec<Had<'r>>) -> Looked {
        let mut had = match found.len() {
            0 => self.nothing_yet(scheduled),
            1 => found.remove(0),
            _ => merged(found).unwrap_or_else(|| self.alone(scheduled)),
        };
        if scheduled.rule.goes_by_parts() {
            self.look(scheduled, &mut had, None, &mut Instant::now());
        }
        let Had {
            mut sink,
            ended,
            took,
        } = had;
        // What was found before a panic is still true.
        let (issues, metadata) = sink.finish();
        let ending = ended.map_or(Ending::Completed, |(_, ending)| ending);
        let outcome = Outcome {
            ending,
            params: scheduled.pass.values.listed(),
            metadata,
            took,
        };
        (issues, outcome)
    }

    /// Has a checker look at all parts, in this thread.
    fn alone(&self, scheduled: &ScheduledRule<'r>) -> Had<'r> {
        let mut had = self.nothing_yet(scheduled);
        let mut clock = Instant::now();
        for part in 0..self.built.parts() {
            self.look(scheduled, &mut had, Some(part), &mut clock);
        }
        had
    }
}

/// What several threads have, as one, as one thread would have it. `None`: that cannot be told.
fn merged(mut found: Vec<Had<'_>>) -> Option<Had<'_>> {
    let ended = found.iter_mut().filter_map(|had| had.ended.take());
    // One thread would have come no further than the first panic.
    let ended = ended.min_by_key(|(part, _)| *part);
    let last = ended.as_ref().map_or(WHOLE, |(part, _)| *part);
    let took = found.iter().map(|had| had.took).sum();
    let mut found = found.into_iter();
    let mut first = found.next()?;
    let rest = found.map(|had| had.sink).collect();
    first.sink.take_in(rest, last).then_some(())?;
    (first.ended, first.took) = (ended, took);
    Some(first)
}

/// Starts a thread. `None`: there is none to be had, and whoever asked does the work himself.
pub(super) fn beside<'s, 'e, T: Send + 's>(
    scope: &'s Scope<'s, 'e>,
    work: impl FnOnce() -> T + Send + 's,
) -> Option<ScopedJoinHandle<'s, T>> {
    let thread = Builder::new().name("checker".to_owned());
    thread.spawn_scoped(scope, work).ok()
}

/// What a thread has to give. Panics of rules and models are caught in it; any other goes on here.
pub(super) fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
