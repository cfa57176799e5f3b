//! Effects of each action on the world, and the invariants that must hold afterwards.

use std::collections::BTreeSet;
use std::sync::Arc;

use qcbus_messages::control::Response;
use qcbus_messages::{ToPeer, Verdict};
use qcbus_types::FinishedJob;

use super::super::*;
use super::reporting::REPORTER;
use super::things::*;
use super::world::*;

impl World {
    pub fn act(&mut self, action: Action) {
        match action {
            Action::Prepare { job, path, waited } => self.is_to_be_read(job, &path, waited),
            Action::Release { job } | Action::ReleaseParts { job } => {
                self.released.insert(job);
            }
            Action::Send { session, message } => self.is_sent(session, message),
            Action::Disconnect { session } | Action::Refuse { session, .. } => {
                self.peers.remove(&session);
            }
            Action::Spawn { launch, spec } => {
                let names = [CHILD, SHADOW, REPORTER];
                self.launched.push(Launched {
                    launch,
                    name: names.into_iter().find(|it| *it == spec.name).unwrap(),
                    version: spec.version.and_then(|it| it.parse().ok()).unwrap_or(1),
                });
            }
            Action::Kill { launch } => {
                self.killed.push(launch);
                let killed = self.launched.iter().position(|it| it.launch == launch);
                let killed = killed.map(|at| self.launched.remove(at));
                self.dying.extend(killed.filter(|it| it.name != REPORTER));
            }
            Action::Enrol(member) => {
                self.members.insert(member.name.clone(), member);
            }
            Action::Strike { name } => {
                self.members.remove(&name);
            }
            Action::Restamp { path, judged } => {
                self.journal.insert(file_of(&path), (*judged).clone());
            }
            Action::Store(job) => self.is_to_be_stored(*job),
            Action::Pool(job) => self.is_to_be_pooled(*job),
            Action::Judged {
                path,
                judged,
                fresh,
            } => self.is_told(file_of(&path), &judged, fresh),
            Action::Answer {
                request_id,
                response,
            } => self.is_answered(request_id, &response),
            Action::Withdraw { path, .. } => self.is_withdrawn(file_of(&path)),
            Action::Depend { files } => {
                let files = files.iter().map(|(path, _)| file_of(path));
                self.watched.extend(files);
            }
            Action::Undepend { paths } => {
                for path in paths {
                    self.watched.remove(&file_of(&path));
                }
            }
            Action::Stop => self.stopped += 1,
            _ => {}
        }
    }

    fn is_withdrawn(&mut self, file: u8) {
        self.journal.remove(&file);
        self.lost.remove(&file);
        self.judged.remove(&file);
    }

    fn is_sent(&mut self, session: SessionId, message: ToPeer) {
        match message {
            ToPeer::Job(job) => {
                assert!(
                    !self.released.contains(&job.job),
                    "the documents of the job must still be available"
                );
                let bundle = self
                    .peers
                    .get_mut(&session)
                    .expect("no job may go to a closed session");
                assert!(
                    bundle.jobs.insert(job.job),
                    "a job is sent once per session"
                );
                assert!(bundle.jobs.len() <= CAPACITY, "the credit limit is kept");
            }
            ToPeer::Cancel { job } => {
                if let Some(bundle) = self.peers.get_mut(&session) {
                    bundle.jobs.remove(&job);
                }
            }
            ToPeer::Drain => {
                if let Some(bundle) = self.peers.get_mut(&session) {
                    bundle.drained = true;
                }
            }
            _ => {}
        }
    }

    fn is_to_be_stored(&mut self, job: FinishedJob) {
        let names: BTreeSet<_> = job.bundles.iter().map(|it| it.name.clone()).collect();
        assert!(
            !names.contains(SHADOW),
            "a result must contain nothing of a shadow"
        );
        assert_eq!(
            names.len(),
            job.bundles.len(),
            "no bundle may be in a result twice"
        );
        for bundle in job.bundles.iter().filter(|it| it.catalogue.is_some()) {
            let said = bundle.said();
            assert_eq!(said.checkers.len(), 2, "every demanded checker is present");
            let mut checkers = said.checkers.iter();
            assert!(
                checkers.all(|it| it.issues.len() <= 2),
                "findings of an ended session are ignored"
            );
        }
        self.storing.push(job);
    }

    fn is_told(&mut self, file: u8, judged: &Judged, fresh: bool) {
        // A verdict of an older epoch may arrive late, if it was already on its way.
        if !fresh || judged.epoch == self.state.epoch() {
            self.must_be_earned(judged);
        }
        let known = self.journal.get(&file).map(|it| it.job);
        assert_eq!(
            known,
            Some(judged.job),
            "a verdict is stored before it is reported"
        );
        let verdict = (judged.inputs.clone(), judged.verdict);
        self.judged.insert(file, verdict);
    }

    fn is_answered(&mut self, request_id: RequestId, response: &Response) {
        if self.client_is_answered(request_id, response) {
            return;
        }
        let file = self
            .waiting
            .remove(&request_id)
            .expect("each request is answered once");
        let until = self.until.remove(&request_id);
        if *response == Response::TimedOut {
            assert!(
                until.is_some_and(|until| until <= self.now),
                "not before the time limit"
            );
        }
        if matches!(response, Response::Verdict(_)) {
            let judged = self.verdict_on(file);
            self.must_be_earned(&judged);
            let told = self.state.inputs_of(&path_of(file));
            assert_eq!(
                told,
                self.inputs(file),
                "the answer is correct at this time"
            );
            let with_all = self.verdict_with_all(file, judged.own);
            assert_eq!(
                judged.verdict, with_all,
                "the verdicts of its dependencies are correct"
            );
        }
    }

    /// Returns the verdict on a file, combined with the journal's verdicts on the files that it rests on.
    pub fn verdict_with_all(&self, file: u8, own: Verdict) -> Verdict {
        let under = dependencies_of(file).iter().filter(|it| **it < 6);
        let there = under.filter(|it| self.there.contains_key(&path_of(**it)));
        there.fold(own, |verdict, it| {
            let known = self.journal.get(it);
            verdict.and(known.map_or(Verdict::Undetermined, |judged| judged.verdict))
        })
    }

    fn verdict_on(&self, file: u8) -> Arc<Judged> {
        let id = self.state.files.id(&path_of(file)).unwrap();
        let entry = self.state.files.get(id).unwrap();
        entry.judged.clone().unwrap()
    }

    /// Asserts that a file is accepted, and reported as accepted, only if all bundles that are
    /// required now have judged it.
    pub fn must_be_earned(&self, judged: &Judged) {
        let (required_set, expected) = (named(&judged.required_set), self.expected_set());
        if judged.verdict == Verdict::Accepted {
            assert_eq!(required_set, expected);
        }
        // A missing bundle is still part of the required set.
        for (required_bundle, must) in required_set.iter().zip(&expected) {
            let same = required_bundle.0 == must.0
                && (required_bundle.1.is_none() || required_bundle.1 == must.1);
            assert!(same, "{required_set:?} instead of {expected:?}");
        }
        assert_eq!(required_set.len(), expected.len());
        let config = digest(self.reconfigured.into());
        assert_eq!(
            judged.config, config,
            "judged with the current configuration"
        );
    }
}
