//! Checks one subject: gates, preconditions, models, panics, and who does it.
//!
//! Checkers of one model make a *strand*: the model is built when the first of them gets through its
//! gates. Strands of which none rests on another go side by side (`Plan::batches`). Within a strand the
//! parts of the model and the checkers that look at the whole of it are tasks, which go to as many
//! threads as there are hands free (`spread.rs`). What is found does not depend on how many there are.

mod gates;
mod spread;
mod strand;

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Level, Metadata, Param};

use crate::hands::Hands;
use crate::plan::Plan;
use crate::{Subject, hands::Hand};

use strand::{Ended, Strand};

/// How a checker ended, and what is to be said besides its findings.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// The parameters that it used.
    pub params: Vec<Param>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
    /// Time that it took, that of all threads together. No result may depend on it.
    pub took: Duration,
}

/// Hears how a check goes on. Checkers are named by their index in [`Plan::checkers`].
pub trait Listener: Sync {
    /// Asked by every thread between two tasks: whether to stop.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// A checker begins, or goes on with another part of the document. Said by whatever thread it is on.
    fn begins(&self, checker: usize) {
        let _ = checker;
    }

    /// A checker has ended with these findings: a demanded one, or one besides that kept a demanded
    /// one from looking. The latter come last. The order is always the same.
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome);
}

/// Runs the plan's checkers on a subject, in this thread. Returns whether it came to its end, that is,
/// was not cancelled. A panic in a rule or a model is that checker's error and nobody else's.
pub fn check(plan: &Plan, subject: &Subject<'_>, listener: &mut dyn Listener) -> bool {
    check_with(plan, subject, &Hands::new(1), listener)
}

/// Runs the plan's checkers on a subject as [`check`] does. This thread counts as one of the `hands`;
/// of those that are free, a large document gets as many as there are.
pub fn check_with(
    plan: &Plan,
    subject: &Subject<'_>,
    hands: &Hands,
    listener: &mut dyn Listener,
) -> bool {
    let subject = subject.clone().with_resources(plan.resources.clone());
    let subject = &subject.under(plan.config.clone());
    let mut run = Run {
        plan,
        standings: vec![None; plan.checkers.len()],
        aside: BTreeMap::new(),
    };
    for batch in &plan.batches {
        let work = Work {
            plan,
            subject,
            hands,
            listener,
            spreads: hands.count() > 1 && subject.root().text_len() >= WORTH_SPREADING,
        };
        let strands = work.side_by_side(batch, &run.standings);
        let cancelled = listener.is_cancelled();
        for ended in strands.into_iter().flatten() {
            run.end(ended, listener);
        }
        if cancelled {
            return false;
        }
    }
    run.tell_what_was_in_the_way(listener);
    true
}

/// Bytes of a document from which on it pays to start a thread for a share of its tasks.
const WORTH_SPREADING: u32 = 96 << 10;

/// What all threads of a check share.
#[derive(Clone, Copy)]
struct Work<'r> {
    plan: &'r Plan,
    subject: &'r Subject<'r>,
    hands: &'r Hands,
    listener: &'r dyn Listener,
    /// The document is large enough for several threads.
    spreads: bool,
}

impl<'r> Work<'r> {
    /// Runs strands of which none rests on another: the largest one here, the others beside it where
    /// hands are free. Gives what ended, by strand.
    fn side_by_side(self, strands: &[usize], standings: &[Option<Standing>]) -> Vec<Vec<Ended>> {
        let run = move |strand: usize, _hand: Option<Hand<'_>>| {
            Strand::new(self, standings).run(&self.plan.groups[strand])
        };
        // The longest list of checkers stays here, so that whoever is beside is free for it soon.
        let Some(here) = (0..strands.len()).max_by_key(|&it| self.plan.groups[strands[it]].len())
        else {
            return Vec::new();
        };
        std::thread::scope(|scope| {
            let mut begun: Vec<Begun<'_>> = Vec::new();
            for (place, &strand) in strands.iter().enumerate() {
                let hand = (self.spreads && place != here).then(|| self.hands.spare());
                begun.push(match hand.flatten() {
                    Some(hand) => spread::beside(scope, move || run(strand, Some(hand)))
                        .map_or(Begun::Due(strand), Begun::Beside),
                    None => Begun::Due(strand),
                });
            }
            for begun in &mut begun {
                if let Begun::Due(strand) = begun {
                    *begun = Begun::Over(run(*strand, None));
                }
            }
            let end = || begun.into_iter().map(Begun::end).collect();
            match self.spreads {
                true => self.hands.wait_for(end),
                false => end(),
            }
        })
    }

    fn stops(&self) -> bool {
        self.listener.is_cancelled()
    }
}

/// A strand that this thread will take or has taken, or that is in a thread of its own.
enum Begun<'s> {
    Due(usize),
    Over(Vec<Ended>),
    Beside(std::thread::ScopedJoinHandle<'s, Vec<Ended>>),
}

impl Begun<'_> {
    fn end(self) -> Vec<Ended> {
        match self {
            Begun::Due(_) => Vec::new(),
            Begun::Over(ended) => ended,
            Begun::Beside(thread) => spread::joined(thread),
        }
    }
}

/// What is known of the checkers of all strands that have ended.
struct Run<'r> {
    plan: &'r Plan,
    standings: Vec<Option<Standing>>,
    /// What undemanded checkers said, as far as they may be in the way of a demanded one.
    aside: BTreeMap<usize, (Vec<Issue>, Outcome)>,
}

/// What matters of a checker to those that come after it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// Not yet at its end: it waits for its turn.
    Waits,
    Clean,
    FoundErrors,
    NotApplicable,
    Blocked,
    Failed,
}

impl Standing {
    fn after(issues: &[Issue], outcome: &Outcome) -> Standing {
        match outcome.ending {
            Ending::Completed if issues.iter().any(|issue| issue.level == Level::Error) => {
                Standing::FoundErrors
            }
            Ending::Completed => Standing::Clean,
            Ending::NotApplicable { .. } => Standing::NotApplicable,
            Ending::Blocked { .. } => Standing::Blocked,
            Ending::Failed { .. } => Standing::Failed,
        }
    }

    /// What it means for those that rest on the checker; `None`: nothing, they may look.
    fn in_the_way(self) -> Option<&'static str> {
        match self {
            Standing::Clean => None,
            Standing::FoundErrors => Some("found errors"),
            Standing::NotApplicable | Standing::Blocked => Some("was skipped"),
            Standing::Failed => Some("failed"),
            Standing::Waits => Some("did not run before it"),
        }
    }

    /// Whether those that rest on the checker could not look because of it. That it does not apply
    /// is no such reason.
    fn is_stop(self) -> bool {
        self.in_the_way().is_some() && self != Standing::NotApplicable
    }
}

impl Run<'_> {
    fn end(&mut self, ended: Ended, listener: &mut dyn Listener) {
        let Ended {
            index,
            issues,
            outcome,
            standing,
        } = ended;
        self.standings[index] = Some(standing);
        if self.plan.entries[index].demanded {
            listener.ended(index, issues, outcome);
        } else if standing.in_the_way().is_some() {
            self.aside.insert(index, (issues, outcome));
        }
    }

    /// The fault that was found is reported, whoever asked: what kept demanded checkers from
    /// looking, directly or through others, says so in the order of the checkers.
    fn tell_what_was_in_the_way(&mut self, listener: &mut dyn Listener) {
        let demanded = |index: &usize| self.plan.entries[*index].demanded;
        let mut open: Vec<usize> = (0..self.standings.len()).filter(demanded).collect();
        let mut told = BTreeSet::new();
        let is_stop = |index: usize| self.standings[index].is_none_or(Standing::is_stop);
        while let Some(index) = open.pop() {
            if self.standings[index] == Some(Standing::Blocked) {
                let after = self.plan.entries[index].after.iter().flatten();
                open.extend(after.filter(|before| is_stop(**before) && told.insert(**before)));
            }
        }
        for index in told {
            if let Some((issues, outcome)) = self.aside.remove(&index) {
                listener.ended(index, issues, outcome);
            }
        }
    }
}

impl Outcome {
    fn failed(reason: String) -> Outcome {
        Outcome::without_run(Ending::Failed { reason })
    }

    fn without_run(ending: Ending) -> Outcome {
        Outcome {
            ending,
            params: Vec::new(),
            metadata: Vec::new(),
            took: Duration::ZERO,
        }
    }
}

/// Runs something that may panic; what a panic said becomes the error.
pub(crate) fn catch<T>(run: impl FnOnce() -> T) -> Result<T, String> {
    // What the closure leaves half done is either dropped or a list of finished findings.
    catch_unwind(AssertUnwindSafe(run)).map_err(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".to_owned())
    })
}
