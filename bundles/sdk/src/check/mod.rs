//! Checks one subject: gates, preconditions, models, panics, and who does it.
//!
//! Checkers of one model make a *strand*: the model is built when the first of them gets through its
//! gates. Strands of which none rests on another go side by side (`Plan::batches`). Within a strand the
//! parts of the model and the checkers that look at the whole of it are tasks, which go to as many
//! threads as there are hands free (`spread.rs`). What is found does not depend on how many there are.

mod checker_group;
mod gates;
mod spread;

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Level, Metadata, Param};

use crate::permits::Permits;
use crate::plan::Plan;
use crate::{Subject, permits::Permit};

use checker_group::{CheckerGroup, Ended};

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
    check_with(plan, subject, &Permits::new(1), listener)
}

/// Runs the plan's checkers on a subject as [`check`] does. This thread counts as one of the `permits`;
/// of those that are free, a large document gets as many as there are.
pub fn check_with(
    plan: &Plan,
    subject: &Subject<'_>,
    permits: &Permits,
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
            permits,
            listener,
            spreads: permits.count() > 1 && subject.root().text_len() >= WORTH_SPREADING,
        };
        let checker_groups = work.side_by_side(batch, &run.standings);
        let cancelled = listener.is_cancelled();
        for ended in checker_groups.into_iter().flatten() {
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
    permits: &'r Permits,
    listener: &'r dyn Listener,
    /// The document is large enough for several threads.
    spreads: bool,
}

impl<'r> Work<'r> {
    /// Runs strands of which none rests on another: the largest one here, the others beside it where
    /// hands are free. Gives what ended, by strand.
    fn side_by_side(
        self,
        checker_groups: &[usize],
        standings: &[Option<RuleState>],
    ) -> Vec<Vec<Ended>> {
        let run = move |checker_group: usize, _permit: Option<Permit<'_>>| {
            CheckerGroup::new(self, standings).run(&self.plan.groups[checker_group])
        };
        // The longest list of checkers stays here, so that whoever is beside is free for it soon.
        let Some(here) =
            (0..checker_groups.len()).max_by_key(|&it| self.plan.groups[checker_groups[it]].len())
        else {
            return Vec::new();
        };
        std::thread::scope(|scope| {
            let mut begun: Vec<Begun<'_>> = Vec::new();
            for (place, &checker_group) in checker_groups.iter().enumerate() {
                let permit = (self.spreads && place != here).then(|| self.permits.spare());
                begun.push(match permit.flatten() {
                    Some(permit) => spread::beside(scope, move || run(checker_group, Some(permit)))
                        .map_or(Begun::Due(checker_group), Begun::Beside),
                    None => Begun::Due(checker_group),
                });
            }
            for begun in &mut begun {
                if let Begun::Due(checker_group) = begun {
                    *begun = Begun::Over(run(*checker_group, None));
                }
            }
            let end = || begun.into_iter().map(Begun::end).collect();
            match self.spreads {
                true => self.permits.wait_for(end),
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
    standings: Vec<Option<RuleState>>,
    /// What undemanded checkers said, as far as they may be in the way of a demanded one.
    aside: BTreeMap<usize, (Vec<Issue>, Outcome)>,
}

/// What matters of a checker to those that come after it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RuleState {
    /// Not yet at its end: it waits for its turn.
    Waits,
    Clean,
    FoundErrors,
    NotApplicable,
    Blocked,
    Failed,
}

impl RuleState {
    fn after(issues: &[Issue], outcome: &Outcome) -> RuleState {
        match outcome.ending {
            Ending::Completed if issues.iter().any(|issue| issue.level == Level::Error) => {
                RuleState::FoundErrors
            }
            Ending::Completed => RuleState::Clean,
            Ending::NotApplicable { .. } => RuleState::NotApplicable,
            Ending::Blocked { .. } => RuleState::Blocked,
            Ending::Failed { .. } => RuleState::Failed,
        }
    }

    /// What it means for those that rest on the checker; `None`: nothing, they may look.
    fn in_the_way(self) -> Option<&'static str> {
        match self {
            RuleState::Clean => None,
            RuleState::FoundErrors => Some("found errors"),
            RuleState::NotApplicable | RuleState::Blocked => Some("was skipped"),
            RuleState::Failed => Some("failed"),
            RuleState::Waits => Some("did not run before it"),
        }
    }

    /// Whether those that rest on the checker could not look because of it. That it does not apply
    /// is no such reason.
    fn is_stop(self) -> bool {
        self.in_the_way().is_some() && self != RuleState::NotApplicable
    }
}

impl Run<'_> {
    fn end(&mut self, ended: Ended, listener: &mut dyn Listener) {
        let Ended {
            index,
            issues,
            outcome,
            rule_state,
        } = ended;
        self.standings[index] = Some(rule_state);
        if self.plan.entries[index].demanded {
            listener.ended(index, issues, outcome);
        } else if rule_state.in_the_way().is_some() {
            self.aside.insert(index, (issues, outcome));
        }
    }

    /// The fault that was found is reported, whoever asked: what kept demanded checkers from
    /// looking, directly or through others, says so in the order of the checkers.
    fn tell_what_was_in_the_way(&mut self, listener: &mut dyn Listener) {
        let demanded = |index: &usize| self.plan.entries[*index].demanded;
        let mut open: Vec<usize> = (0..self.standings.len()).filter(demanded).collect();
        let mut told = BTreeSet::new();
        let is_stop = |index: usize| self.standings[index].is_none_or(RuleState::is_stop);
        while let Some(index) = open.pop() {
            if self.standings[index] == Some(RuleState::Blocked) {
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
