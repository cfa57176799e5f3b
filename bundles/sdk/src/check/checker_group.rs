//! Runs the checkers of one model in order.

use super::gates::Pass;
use super::spread::ScheduledRule;
use super::{Outcome, RuleState, Work, catch};
use crate::rule::Built;
use qcbus_formats::xqar::Issue;

/// A checker that has ended.
pub(super) struct Ended {
    pub index: usize,
    pub issues: Vec<Issue>,
    pub outcome: Outcome,
    pub rule_state: RuleState,
}

/// Runner for the checkers of one model.
pub(super) struct CheckerGroup<'r> {
    pub work: Work<'r>,
    /// States of all checkers: those of earlier batches, and those of this group.
    pub standings: Vec<Option<RuleState>>,
    ended: Vec<Ended>,
}

impl<'r> CheckerGroup<'r> {
    pub fn new(work: Work<'r>, standings: &[Option<RuleState>]) -> CheckerGroup<'r> {
        CheckerGroup {
            work,
            standings: standings.to_vec(),
            ended: Vec::new(),
        }
    }

    /// Runs the members of the group that take part. Returns the ended checkers.
    pub fn run(mut self, group: &[usize]) -> Vec<Ended> {
        let entries = &self.work.plan.entries;
        let runs = |index: &usize| entries[*index].runs;
        let members: Vec<usize> = group.iter().copied().filter(runs).collect();
        self.group(&members);
        self.ended
    }

    /// Runs checkers of one model. The model is built when the first of them passes its gates.
    fn group(&mut self, members: &[usize]) {
        let mut rest = members.iter().copied();
        let builder = loop {
            let Some(index) = rest.next() else { return };
            if self.work.stops() {
                return;
            }
            match self.gate(index) {
                Ok(pass) => break (index, pass),
                Err(outcome) => self.end(index, Vec::new(), outcome),
            }
        };
        let (subject, rule) = (self.work.subject, self.work.plan.checkers[builder.0].rule);
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

    /// Runs checkers on the built model. As many as possible work on the same part one after the
    /// other. They are collected until a checker needs the ending of one of them.
    fn on_model(
        &mut self,
        first: (usize, Pass<'r>),
        rest: &mut dyn Iterator<Item = usize>,
        built: &dyn Built<'r>,
    ) {
        let mut waiting = Vec::with_capacity(self.work.plan.checkers.len());
        waiting.push(self.scheduled(first.0, first.1));
        for index in rest {
            let entry = &self.work.plan.entries[index];
            let after = entry.after.as_deref().unwrap_or(&[]);
            let mut standings = after.iter().map(|before| self.standings[*before]);
            if standings.any(|rule_state| rule_state == Some(RuleState::Waits)) {
                self.take(&std::mem::take(&mut waiting), built);
            }
            if self.work.stops() {
                return;
            }
            match self.gate(index) {
                Ok(pass) => waiting.push(self.scheduled(index, pass)),
                Err(outcome) => self.end(index, Vec::new(), outcome),
            }
        }
        self.take(&waiting, built);
    }

    fn scheduled(&mut self, index: usize, pass: Pass<'r>) -> ScheduledRule<'r> {
        self.standings[index] = Some(RuleState::Waits);
        let checker = &self.work.plan.checkers[index];
        ScheduledRule {
            index,
            rule: checker.rule,
            facts: &checker.facts,
            pass,
        }
    }

    /// Runs checkers on the parts of the model and on the whole, and stores their endings.
    fn take(&mut self, schedule: &[ScheduledRule<'r>], built: &dyn Built<'r>) {
        let Some(looked) = self.work.look(schedule, built) else {
            return;
        };
        for (scheduled, (issues, outcome)) in schedule.iter().zip(looked) {
            self.end(scheduled.index, issues, outcome);
        }
    }

    fn end(&mut self, index: usize, issues: Vec<Issue>, outcome: Outcome) {
        let rule_state = RuleState::after(&issues, &outcome);
        self.standings[index] = Some(rule_state);
        self.ended.push(Ended {
            index,
            issues,
            outcome,
            rule_state,
        });
    }
}
