//! Chunks of a checker group, and the threads that run them.
//!
//! A chunk is either a part of the model for all checkers that work by parts, or the whole for one
//! checker. Every thread has its own sinks for the findings of its chunks. They are merged into the
//! list that a single thread would produce: findings in the order of their parts. In some cases the
//! sinks are not sufficient for this: a checker found more than it lists, or counts references.
//! Then it runs once more in one thread, because rules are deterministic.

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

/// A checker that has passed its gates.
pub(super) struct ScheduledRule<'r> {
    pub index: usize,
    pub rule: &'static dyn AnyRule,
    pub facts: &'r Facts,
    pub pass: Pass<'r>,
}

/// Findings of a checker, and its ending.
type Looked = (Vec<Issue>, Outcome);

/// Findings of one checker in one thread.
struct Had<'r> {
    sink: Sink<'r>,
    took: Duration,
    /// Part at which the checker failed or ended, and its ending. It is not called again.
    ended: Option<(u32, Ending)>,
}

/// The chunks and the number of the next one.
struct Chunks<'t, 'r> {
    work: Work<'r>,
    schedule: &'t [ScheduledRule<'r>],
    /// Indices in `schedule` of the checkers that work by parts.
    by_parts: Vec<usize>,
    /// Indices of the checkers that look at the whole model only. The others do so after the parts,
    /// and may ask for the findings of the parts.
    wholes: Vec<usize>,
    built: &'t dyn Built<'r>,
    next: AtomicUsize,
}

/// Time that a thread works on chunks before it starts others. A few short chunks are not worth a
/// thread: a start takes a tenth of a millisecond.
const WORTH_A_THREAD: Duration = Duration::from_micros(100);

/// Findings of one thread, by index of the scheduled checker.
type Pile<'r> = Vec<Option<Had<'r>>>;

impl<'r> Work<'r> {
    /// Runs checkers on the parts of the model and on the whole. Returns their results in their
    /// order, or `None` if the check was cancelled.
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
        let chunks = Chunks {
            work: self,
            schedule,
            by_parts: places(|rule| rule.goes_by_parts()),
            wholes: places(|rule| !rule.goes_by_parts()),
            built,
            next: AtomicUsize::new(0),
        };
        let mut piles = if self.spreads {
            chunks.by_many()
        } else {
            let mut own = chunks.empty_pile();
            while chunks.one(&mut own) {}
            vec![own]
        };
        if self.stops() {
            return None;
        }
        let of = |place: usize| {
            let of_all = piles.iter_mut();
            let found = of_all.filter_map(|it| it.get_mut(place)?.take()).collect();
            chunks.together(&schedule[place], found)
        };
        Some((0..schedule.len()).map(of).collect())
    }
}

impl<'r> Chunks<'_, 'r> {
    /// Runs chunks in this thread, and starts other threads as long as permits are free.
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

    /// Runs chunks with a borrowed permit until a job needs it.
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

    /// Returns the number of chunks that no thread has taken.
    fn left(&self) -> usize {
        self.count()
            .saturating_sub(self.next.load(Ordering::Relaxed))
    }

    /// Runs one chunk. Returns `false` if there is none.
    fn one(&self, own: &mut Pile<'r>) -> bool {
        if self.work.stops() {
            return false;
        }
        let chunk = self.next.fetch_add(1, Ordering::Relaxed);
        let parts = self.built.parts();
        if chunk < parts {
            let mut clock = Instant::now();
            for &place in &self.by_parts {
                let (scheduled, had) = self.in_pile(own, place);
                self.look(scheduled, had, Some(chunk), &mut clock);
            }
        } else if let Some(&place) = self.wholes.get(chunk - parts) {
            let (scheduled, had) = self.in_pile(own, place);
            self.look(scheduled, had, None, &mut Instant::now());
        }
        chunk < self.count()
    }

    /// Returns a checker and its findings in this thread.
    fn in_pile<'p>(
        &self,
        pile: &'p mut Pile<'r>,
        place: usize,
    ) -> (&ScheduledRule<'r>, &'p mut Had<'r>) {
        let scheduled = &self.schedule[place];
        let had = pile[place].get_or_insert_with(|| self.nothing_yet(scheduled));
        (scheduled, had)
    }

    /// Runs a checker on a part, or on the whole (`None`). `clock` holds the time of the start, and
    /// afterwards that of the end.
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

    /// Merges the findings of a checker from all threads into its result.
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
        // The findings before a panic remain valid.
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

    /// Runs a checker on all parts in this thread.
    fn alone(&self, scheduled: &ScheduledRule<'r>) -> Had<'r> {
        let mut had = self.nothing_yet(scheduled);
        let mut clock = Instant::now();
        for part in 0..self.built.parts() {
            self.look(scheduled, &mut had, Some(part), &mut clock);
        }
        had
    }
}

/// Merges the findings of several threads into those of a single thread. Returns `None` if that is
/// not possible.
fn merged(mut found: Vec<Had<'_>>) -> Option<Had<'_>> {
    let ended = found.iter_mut().filter_map(|had| had.ended.take());
    // A single thread would stop at the first panic.
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

/// Starts a thread. Returns `None` if that fails; the caller then does the work itself.
pub(super) fn beside<'s, 'e, T: Send + 's>(
    scope: &'s Scope<'s, 'e>,
    work: impl FnOnce() -> T + Send + 's,
) -> Option<ScopedJoinHandle<'s, T>> {
    let thread = Builder::new().name("checker".to_owned());
    thread.spawn_scoped(scope, work).ok()
}

/// Returns the result of a thread. It catches panics of rules and models itself; any other panic is
/// propagated.
pub(super) fn joined<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
