//! Checks one subject: gates, preconditions, models, panics and threads.
//!
//! Checkers of one model form a *checker group*. The model is built when the first of them passes
//! its gates. Groups without mutual preconditions run in parallel (`Plan::batches`). Within a
//! group, each part of the model is a chunk, and so is each checker of the whole model. As many
//! threads as there are free permits run the chunks (`spread.rs`). The findings do not depend on the
//! number of threads.

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

/// Ending of a checker, with further facts besides its findings.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The ending.
    pub ending: Ending,
    /// The parameters that the checker used.
    pub params: Vec<Param>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
    /// Time spent by all threads together. No result may depend on it.
    pub took: Duration,
}

/// Observer of a check. Checkers are identified by their index in [`Plan::checkers`].
pub trait Listener: Sync {
    /// Returns whether to stop. Every thread asks this between two chunks.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Reports that a checker begins, or continues with another part of the document. Any thread
    /// may call it.
    fn begins(&self, checker: usize) {
        let _ = checker;
    }

    /// Reports the findings and the ending of a checker. It is a demanded checker, or another one
    /// that blocked a demanded one. The latter come last. The order is always the same.
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome);
}

/// Runs the plan's checkers on a subject in this thread. Returns `false` if the check was
/// cancelled. A panic in a rule or a model is an error of that checker only.
pub fn check(plan: &Plan, subject: &Subject<'_>, listener: &mut dyn Listener) -> bool {
    check_with(plan, subject, &Permits::new(1), listener)
}

/// Runs the plan's checkers on a subject as [`check`] does. This thread already has one of the
/// `permits`. A large document gets all free ones.
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

/// Minimum size in bytes of a document for which starting another thread pays off.
const WORTH_SPREADING: u32 = 96 << 10;

/// Data shared by all threads of a check.
#[derive(Clone, Copy)]
struct Work<'r> {
    plan: &'r Plan,
    subject: &'r Subject<'r>,
    permits: &'r Permits,
    listener: &'r dyn Listener,
    /// Whether the document is large enough for several threads.
    spreads: bool,
}

impl<'r> Work<'r> {
    /// Runs checker groups without mutual preconditions. The largest one runs in this thread, the
    /// others in new threads if permits are free. Returns the ended checkers by group.
    fn side_by_side(
        self,
        checker_groups: &[usize],
        standings: &[Option<RuleState>],
    ) -> Vec<Vec<Ended>> {
        let run = move |checker_group: usize, _permit: Option<Permit<'_>>| {
            CheckerGroup::new(self, standings).run(&self.plan.groups[checker_group])
        };
        // The longest list of checkers stays in this thread, so that the other threads are soon
        // free to help with it.
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

/// A checker group: not yet run, run in this thread, or running in its own thread.
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

/// Results of the checkers of all groups that have ended.
struct Run<'r> {
    plan: &'r Plan,
    standings: Vec<Option<RuleState>>,
    /// Results of undemanded checkers that may block a demanded one.
    aside: BTreeMap<usize, (Vec<Issue>, Outcome)>,
}

/// State of a checker as seen by the checkers that depend on it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RuleState {
    /// Not yet ended: the checker waits to be run.
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

    /// Returns the reason why dependent checkers cannot run, or `None` if they can.
    fn in_the_way(self) -> Option<&'static str> {
        match self {
            RuleState::Clean => None,
            RuleState::FoundErrors => Some("found errors"),
            RuleState::NotApplicable | RuleState::Blocked => Some("was skipped"),
            RuleState::Failed => Some("failed"),
            RuleState::Waits => Some("did not run before this checker"),
        }
    }

    /// Checks whether the checker blocks its dependents. A checker that does not apply does not
    /// block them.
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

    /// Reports the undemanded checkers that blocked demanded ones, directly or indirectly, in the
    /// order of the checkers. A found fault is reported even if its checker is not demanded.
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

/// Runs code that may panic. The panic message becomes the error.
pub(crate) fn catch<T>(run: impl FnOnce() -> T) -> Result<T, String> {
    // A panic leaves only two kinds of data: data that is dropped, and a list of complete findings.
    catch_unwind(AssertUnwindSafe(run)).map_err(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".to_owned())
    })
}
