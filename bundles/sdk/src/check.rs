//! Checks one subject: gates, preconditions, models, panics.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Level, Metadata, Param};

use crate::plan::{Entry, Plan};
use crate::rule::Built;
use crate::{AnyRule, Backport, Checker, Sink, Subject, Values, Version};

/// How a checker ended, and what is to be said besides its findings.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// The parameters that it used.
    pub params: Vec<Param>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
    /// Time that it took. No result may depend on it.
    pub took: Duration,
}

/// Hears how a check goes on. Checkers are named by their index in [`Plan::checkers`].
pub trait Listener {
    /// Asked between checkers: whether to stop.
    fn is_cancelled(&mut self) -> bool {
        false
    }

    /// A checker begins, or goes on with another part of the document.
    fn begins(&mut self, checker: usize) {
        let _ = checker;
    }

    /// A checker has ended with these findings: a demanded one, or one besides that kept a demanded
    /// one from looking. The latter come last.
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome);
}

/// Runs the plan's checkers on a subject. Returns whether it came to its end, that is, was not
/// cancelled. A panic in a rule or a model is that checker's error and nobody else's.
pub fn check(plan: &Plan, subject: &Subject<'_>, listener: &mut dyn Listener) -> bool {
    let subject = &subject.clone().with_resources(plan.resources.clone());
    let mut run = Run {
        plan,
        subject,
        listener,
        standings: vec![None; plan.checkers.len()],
        aside: BTreeMap::new(),
        cancelled: false,
    };
    for group in &plan.groups {
        let members: Vec<usize> = group
            .iter()
            .copied()
            .filter(|&i| plan.entries[i].runs)
            .collect();
        run.group(&members);
    }
    if !run.cancelled {
        run.tell_what_was_in_the_way();
    }
    !run.cancelled
}

struct Run<'r> {
    plan: &'r Plan,
    subject: &'r Subject<'r>,
    listener: &'r mut dyn Listener,
    standings: Vec<Option<Standing>>,
    /// What undemanded checkers said, as far as they may be in the way of a demanded one.
    aside: BTreeMap<usize, (Vec<Issue>, Outcome)>,
    cancelled: bool,
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
}

/// How a checker is let through: with a note when its rule is not normative for the version.
struct Pass<'r> {
    values: &'r Values,
    not_normative: Option<String>,
}

/// A checker at work.
struct Turn<'r> {
    index: usize,
    rule: &'static dyn AnyRule,
    values: &'r Values,
    sink: Sink<'r>,
    took: Duration,
    /// What its panic said; it is not asked again.
    failed: Option<String>,
}

impl<'r> Turn<'r> {
    /// Has it look at something. `clock` is when that began, and then when it ended.
    fn look(&mut self, clock: &mut Instant, at: impl FnOnce(&dyn AnyRule, &mut Sink<'r>)) {
        if self.failed.is_none() {
            self.failed = catch(|| at(self.rule, &mut self.sink)).err();
        }
        let now = Instant::now();
        self.took += now.duration_since(*clock);
        *clock = now;
    }
}

impl<'r> Run<'r> {
    /// Runs checkers of one model, which is built when the first of them gets through its gates.
    fn group(&mut self, members: &[usize]) {
        let mut rest = members.iter().copied();
        let builder = loop {
            let Some(index) = rest.next() else { return };
            if self.stops() {
                return;
            }
            match self.gate(index) {
                Ok(pass) => break (index, pass),
                Err(outcome) => self.end(index, Vec::new(), outcome),
            }
        };
        let (subject, rule) = (self.subject, self.plan.checkers[builder.0].rule);
        let mut first = Some(builder);
        let mut open: Vec<usize> = members.to_vec();
        let built = catch(|| {
            rule.with_model(subject, &mut |built| {
                open.clear();
                if let Some(first) = first.take() {
                    self.on_model(first, &mut rest, built);
                }
            })
        });
        let outcome = match built {
            Ok(Ok(())) => return,
            Ok(Err(unbuilt)) => Outcome::without_run(unbuilt.into()),
            Err(panic) => Outcome::failed(format!("its model panicked: {panic}")),
        };
        for index in open {
            if self.standings[index].is_none() {
                let outcome = self
                    .gate(index)
                    .map_or_else(|gated| gated, |_| outcome.clone());
                self.end(index, Vec::new(), outcome);
            }
        }
    }

    /// Runs checkers on the model that was built. As many as possible look at a part in turn: they
    /// wait until one comes that needs to know how one of them ended.
    fn on_model(
        &mut self,
        first: (usize, Pass<'r>),
        rest: &mut dyn Iterator<Item = usize>,
        built: &dyn Built<'r>,
    ) {
        let mut waiting = Vec::with_capacity(self.plan.checkers.len());
        waiting.push(self.turn(first.0, first.1));
        for index in rest {
            let after = self.plan.entries[index].after.as_deref().unwrap_or(&[]);
            let mut standings = after.iter().map(|before| self.standings[*before]);
            if standings.any(|standing| standing == Some(Standing::Waits)) {
                self.take(&mut waiting, built);
                waiting.clear();
            }
            if self.stops() {
                return;
            }
            match self.gate(index) {
                Ok(pass) => waiting.push(self.turn(index, pass)),
                Err(outcome) => self.end(index, Vec::new(), outcome),
            }
        }
        self.take(&mut waiting, built);
    }

    fn turn(&mut self, index: usize, pass: Pass<'r>) -> Turn<'r> {
        self.standings[index] = Some(Standing::Waits);
        let checker = &self.plan.checkers[index];
        let Pass {
            values,
            not_normative,
        } = pass;
        Turn {
            index,
            rule: checker.rule,
            values,
            sink: Sink::new(self.subject, &checker.facts, values, not_normative),
            took: Duration::ZERO,
            failed: None,
        }
    }

    /// Has checkers look at one part of the model after the other, and then at the whole.
    fn take(&mut self, turns: &mut [Turn<'r>], built: &dyn Built<'r>) {
        for part in 0..built.parts() {
            if self.stops() {
                return;
            }
            let mut clock = Instant::now();
            let asked = |turn: &&mut Turn<'r>| turn.rule.goes_by_parts() && turn.failed.is_none();
            for turn in turns.iter_mut().filter(asked) {
                self.listener.begins(turn.index);
                turn.look(&mut clock, |rule, sink| built.each(part, rule, sink));
            }
        }
        let mut clock = Instant::now();
        for turn in turns {
            if self.stops() {
                return;
            }
            self.listener.begins(turn.index);
            turn.look(&mut clock, |rule, sink| built.run(rule, sink));
            self.close(turn);
        }
    }

    fn stops(&mut self) -> bool {
        self.cancelled = self.cancelled || self.listener.is_cancelled();
        self.cancelled
    }

    fn close(&mut self, turn: &mut Turn<'r>) {
        // What was found before a panic is still true.
        let (issues, metadata) = turn.sink.finish();
        let ending = match turn.failed.take() {
            None => Ending::Completed,
            Some(panic) => Ending::Failed {
                reason: format!("the rule panicked: {panic}"),
            },
        };
        let outcome = Outcome {
            ending,
            params: turn.values.listed(),
            metadata,
            took: turn.took,
        };
        self.end(turn.index, issues, outcome);
    }

    fn end(&mut self, index: usize, issues: Vec<Issue>, outcome: Outcome) {
        let found_errors = issues.iter().any(|issue| issue.level == Level::Error);
        let standing = match outcome.ending {
            Ending::Completed if found_errors => Standing::FoundErrors,
            Ending::Completed => Standing::Clean,
            Ending::NotApplicable { .. } => Standing::NotApplicable,
            Ending::Blocked { .. } => Standing::Blocked,
            Ending::Failed { .. } => Standing::Failed,
        };
        self.standings[index] = Some(standing);
        if self.plan.entries[index].demanded {
            self.listener.ended(index, issues, outcome);
        } else if standing.in_the_way().is_some() {
            self.aside.insert(index, (issues, outcome));
        }
    }

    /// The fault that was found is reported, whoever asked: what kept demanded checkers from
    /// looking, directly or through others, says so in the order of the checkers.
    fn tell_what_was_in_the_way(&mut self) {
        let demanded = |index: &usize| self.plan.entries[*index].demanded;
        let mut open: Vec<usize> = (0..self.standings.len()).filter(demanded).collect();
        let mut told = BTreeSet::new();
        while let Some(index) = open.pop() {
            if self.standings[index] == Some(Standing::Blocked) {
                let after = self.plan.entries[index].after.iter().flatten();
                open.extend(after.filter(|before| self.is_stop(**before) && told.insert(**before)));
            }
        }
        for index in told {
            if let Some((issues, outcome)) = self.aside.remove(&index) {
                self.listener.ended(index, issues, outcome);
            }
        }
    }

    /// Whether those that rest on the checker could not look because of it. That it does not apply
    /// is no such reason.
    fn is_stop(&self, index: usize) -> bool {
        let standing = self.standings[index].unwrap_or(Standing::Waits);
        standing.in_the_way().is_some() && standing != Standing::NotApplicable
    }

    /// Parameters, preconditions, version: in this order.
    fn gate(&self, index: usize) -> Result<Pass<'r>, Outcome> {
        let plan = self.plan;
        let (checker, entry) = (&plan.checkers[index], &plan.entries[index]);
        let fails = |reason: &String| Outcome::failed(reason.clone());
        let values = entry.values.as_ref().map_err(fails)?;
        let with_params = |mut outcome: Outcome| {
            outcome.params = values.listed();
            outcome
        };
        self.preconditions(entry).map_err(with_params)?;
        let not_normative = self.version_gate(checker).map_err(with_params)?;
        Ok(Pass {
            values,
            not_normative,
        })
    }

    /// Whether everything that the checker rests on has looked and found no error. What rests on a
    /// checker that does not apply does not apply either; anything else is in its way.
    fn preconditions(&self, entry: &Entry) -> Result<(), Outcome> {
        let fails = |reason: &String| Outcome::failed(reason.clone());
        let after = entry.after.as_ref().map_err(fails)?;
        let mut stopped: Option<String> = None;
        let mut by = Vec::new();
        for &index in after {
            let standing = self.standings[index].unwrap_or(Standing::Waits);
            let Some(what) = standing.in_the_way() else {
                continue;
            };
            let id = &self.plan.checkers[index].id;
            stopped.get_or_insert_with(|| format!("`{id}` {what}"));
            if self.is_stop(index) {
                by.push(id.clone());
            }
        }
        let Some(reason) = stopped else {
            return Ok(());
        };
        Err(Outcome::without_run(if by.is_empty() {
            Ending::NotApplicable { reason }
        } else {
            Ending::Blocked { by, reason }
        }))
    }

    /// Whether the checker applies to the document's version; with the note of a backport.
    fn version_gate(&self, checker: &Checker) -> Result<Option<String>, Outcome> {
        let fails = |reason: &String| Outcome::failed(reason.clone());
        let skips = |reason: String| Outcome::without_run(Ending::NotApplicable { reason });
        let range = checker.range.as_ref().map_err(fails)?;
        if range.is_everything() {
            return Ok(None);
        }
        let standard = self.plan.bundle.standard;
        let Some(version) = self.subject.version() else {
            let reason =
                format!("the rule applies to {standard} {range}; the file names no version");
            // Whether it applies cannot be known, because the document lacks what it must say.
            return Err(Outcome::without_run(Ending::Blocked {
                by: Vec::new(),
                reason,
            }));
        };
        let backported = range.is_before(version) && reaches_back(checker.facts.backport, version)?;
        let separate = checker.facts.backport.is_separate();
        let alike = matches!(checker.facts.backport, Backport::Alike { .. });
        match (checker.is_backport, range.contains(version), backported) {
            (false, true, _) => Ok(None),
            (true, _, true) if alike => Ok(None),
            (true, _, true) => Ok(Some(note(standard, version, range))),
            (false, _, true) if !separate => Ok(Some(note(standard, version, range))),
            (true, true, _) => Err(skips(format!(
                "the rule itself applies to {standard} {version}"
            ))),
            _ => Err(skips(format!(
                "the rule applies to {standard} {range}; the file is {version}"
            ))),
        }
    }
}

fn note(standard: &str, version: Version, range: &crate::VersionRange) -> String {
    format!(" ({standard} {version} does not demand this: the rule applies to {range})")
}

fn reaches_back(backport: Backport, version: Version) -> Result<bool, Outcome> {
    match backport {
        Backport::None => Ok(false),
        Backport::Lower { since: "" }
        | Backport::Separate { since: "" }
        | Backport::Alike { since: "" } => Ok(true),
        Backport::Lower { since } | Backport::Separate { since } | Backport::Alike { since } => {
            let wrong = |error: crate::VersionError| Outcome::failed(error.to_string());
            Ok(since.parse::<Version>().map_err(wrong)? <= version)
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
fn catch<T>(run: impl FnOnce() -> T) -> Result<T, String> {
    // What the closure leaves half done is either dropped or a list of finished findings.
    catch_unwind(AssertUnwindSafe(run)).map_err(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".to_owned())
    })
}
