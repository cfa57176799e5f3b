//! Errands: checks that clients ask for, of any file that this broker may read.
//!
//! An errand is a job like others, without anything that lasts: no verdict that stands, no result among the others,
//! no gate, no journal, no reporter. Whoever asked gets what a run of its own would find, or is told to
//! make one: that is what becomes of all that would be otherwise here than there.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_messages::control::{Checked, Response};
use qcbus_messages::{Absence, JobId, MissingDocument};

use super::action::Action;
use super::files::{FileId, Priority, Stage};
use super::jobs::{ActiveJob, JobStage, ShareState};
use super::jury::{Origin, Seat};
use super::trials::TrialEnd;
use super::types::Ticket;
use super::{Actions, Phase, State};

/// What a client asked for.
#[derive(Debug, Clone)]
pub struct Errand {
    /// The client.
    pub ticket: Ticket,
    /// The bundles that are to look at the file, and nobody else.
    pub bundles: Arc<[String]>,
}

/// What became of an errand whose file was checked.
#[derive(Debug, Clone, PartialEq)]
pub enum ErrandOutcome {
    /// Here is what was found.
    Pooled(Box<Checked>),
    /// This is what a shadow found.
    Tried(TrialEnd),
    /// The file has changed since it was read.
    Stale,
    /// Others must judge by now, or otherwise.
    Outdated,
    /// It cannot be told; the reason is for a person.
    Failed(String),
}

/// The errands that are under way, by client.
pub(super) type Errands = BTreeMap<Ticket, FileId>;

impl State {
    /// A client wants a file checked.
    pub(super) fn errand(&mut self, path: &Arc<Path>, errand: Errand, actions: &mut Actions) {
        let ticket = errand.ticket;
        let kind = match self.takes_errand(path, &errand) {
            Ok(kind) => kind,
            Err(reason) => return elsewhere(ticket, reason, actions),
        };
        let id = self.files.insert_errand(path, kind, errand);
        self.errands.insert(ticket, id);
        self.files.enqueue(id, Priority::Errand, self.now);
    }

    /// Whether a job is done for a client alone.
    pub fn is_errand(&self, job: JobId) -> bool {
        self.jobs.get(&job).is_some_and(|it| it.errand.is_some())
    }

    fn takes_errand(&self, path: &Path, errand: &Errand) -> Result<FileKind, String> {
        if self.phase != Phase::Running {
            return Err("the broker is stopping".to_owned());
        }
        let fails = |name: &&String| !self.is_as_started(name) || self.hopeless(name).is_some();
        if let Some(name) = errand.bundles.iter().find(fails) {
            return Err(format!("{name} is not there"));
        }
        FileKind::of_path(path).ok_or_else(|| "it is no file that qcbus checks".to_owned())
    }

    /// Whether a bundle is there as the very program that is started under its name now.
    fn is_as_started(&self, name: &str) -> bool {
        let bundle = self.bundles.get(name);
        let bundle = bundle.filter(|it| it.origin == Some(Origin::Supervised));
        let launch = bundle.and_then(|it| it.launch.filter(|_| it.catalogue.is_some()));
        let child = self.children.get(name);
        launch
            .zip(child)
            .is_some_and(|(launch, child)| launch.is_of(&child.spec))
    }

    /// Those of the seats that an errand asks for.
    pub(super) fn seats_of(&self, job: &ActiveJob) -> Arc<[Seat]> {
        let seats = self.seats(job.kind);
        match &job.errand {
            None => seats,
            Some(errand) if errand.ticket.is_trial() => {
                self.seats_of_trial(&errand.bundles, job.kind)
            }
            Some(errand) => {
                let asked = |seat: &&Seat| errand.bundles.contains(&seat.name);
                seats.iter().filter(asked).cloned().collect()
            }
        }
    }

    /// An errand whose shares are all there is pooled, if what was found is what whoever asked would find.
    pub(super) fn pool_errand(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        let Some(errand) = job.errand.clone() else {
            return;
        };
        job.stage = JobStage::Storing;
        if errand.ticket.is_trial() {
            return self.pool_trial(id, actions);
        }
        let whole = job.shares.len() == errand.bundles.len();
        // Why a bundle has failed need not lie in the file: another process of it may find what there is.
        let mut shares = job.shares.values();
        let done = shares.all(|share| share.state == ShareState::Done);
        // Whoever asks may have rights that this process has not.
        let refused = |it: &MissingDocument| matches!(it.why, Absence::Unreadable { .. });
        let prepared = job.prepared.as_deref();
        if prepared.is_some_and(|it| it.missing.iter().any(refused)) {
            let reason = "something that the file refers to cannot be read".to_owned();
            return self.send_elsewhere(id, reason, actions);
        }
        let same = errand.bundles.iter().all(|name| self.is_as_started(name));
        if whole && done && same {
            let finished = self.finished(id);
            actions.extend(finished.map(|it| Action::Pool(Box::new(it))));
        } else {
            let reason = "a bundle that is to look at it has failed or is not there".to_owned();
            self.send_elsewhere(id, reason, actions);
        }
    }

    /// What became of an errand after its file was checked.
    pub(super) fn pooled(&mut self, id: JobId, outcome: ErrandOutcome, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        let Some(errand) = job.errand.clone() else {
            return;
        };
        let ticket = errand.ticket;
        if !self.errands.contains_key(&ticket) {
            return self.end_job(id, actions);
        }
        match outcome {
            ErrandOutcome::Pooled(checked) => {
                self.errands.remove(&ticket);
                let response = Response::Checked(checked);
                actions.push(Action::Answer { ticket, response });
                self.end_job(id, actions);
            }
            ErrandOutcome::Tried(found) => {
                self.errands.remove(&ticket);
                self.trial_ended(ticket, Ok(found));
                self.end_job(id, actions);
            }
            ErrandOutcome::Stale => self.end_job(id, actions),
            // The configuration is the same, or the errand would have been dismissed.
            ErrandOutcome::Outdated => {
                job.stage = JobStage::Checking;
                self.reseat(id, actions);
            }
            ErrandOutcome::Failed(reason) => self.send_elsewhere(id, reason, actions),
        }
    }

    /// Ends the job of an errand that cannot be done here.
    pub(super) fn send_elsewhere(&mut self, id: JobId, reason: String, actions: &mut Actions) {
        let errand = self.jobs.get(&id).and_then(|job| job.errand.as_ref());
        if let Some(ticket) = errand.map(|it| it.ticket)
            && self.errands.remove(&ticket).is_some()
        {
            if ticket.is_trial() {
                self.trial_ended(ticket, Err(reason));
            } else {
                elsewhere(ticket, reason, actions);
            }
        }
        self.end_job(id, actions);
    }

    /// The job of an errand is over: it is begun again, unless somebody was answered or has left.
    pub(super) fn errand_is_over(&mut self, file: FileId, ticket: Ticket, actions: &mut Actions) {
        let Some(entry) = self.files.get(file) else {
            return;
        };
        if !self.errands.contains_key(&ticket) {
            self.files.remove(file);
        } else if ticket.is_trial() {
            self.errands.remove(&ticket);
            self.files.remove(file);
            self.put_trial_back(ticket);
        } else if entry.present {
            self.files.enqueue(file, Priority::Errand, self.now);
        } else {
            self.errands.remove(&ticket);
            self.files.remove(file);
            elsewhere(ticket, "it is not there any more".to_owned(), actions);
        }
    }

    /// Nobody who has asked can be answered any more: configuration or bundles are others, so that what would be found
    /// now is not what was asked for, or the broker has stopped.
    pub(super) fn dismiss_errands(&mut self, reason: &str, actions: &mut Actions) {
        let tickets: Vec<Ticket> = self.errands.keys().copied().collect();
        for ticket in tickets {
            if ticket.is_trial() {
                self.put_trial_back(ticket);
            } else {
                elsewhere(ticket, reason.to_owned(), actions);
            }
            self.abandon(ticket, actions);
        }
    }

    /// Nobody needs any more what a client asked for.
    pub(super) fn abandon(&mut self, ticket: Ticket, actions: &mut Actions) {
        let Some(file) = self.errands.remove(&ticket) else {
            return;
        };
        match self.files.get(file).map(|entry| entry.stage().clone()) {
            Some(Stage::Active(job)) => {
                let job = self.jobs.get(&job).map(|it| (job, it.stage));
                if let Some((job, stage)) = job
                    && stage.is_before_storing()
                {
                    self.end_job(job, actions);
                }
            }
            _ => self.files.remove(file),
        }
    }

    /// A bundle died that had errands. They are not tried again: a verdict would keep others from that, but of an errand
    /// nothing is known when the next one asks, and this bundle is needed by all.
    pub(super) fn turn_away_suspects(&mut self, actions: &mut Actions) {
        let suspect = |job: &ActiveJob| job.shares.values().any(|share| share.suspect);
        let jobs = self.jobs.iter();
        let suspects = jobs.filter(|(_, job)| job.errand.is_some() && suspect(job));
        let suspects: Vec<JobId> = suspects.map(|(id, _)| *id).collect();
        for id in suspects {
            if self.try_again(id, actions) {
                continue;
            }
            let reason = "a bundle has failed while it looked at it".to_owned();
            self.send_elsewhere(id, reason, actions);
        }
    }

    /// No new jobs are begun any more: whoever still waits for one makes it himself.
    pub(super) fn turn_away_waiting_errands(&mut self, actions: &mut Actions) {
        let waits = |file: &FileId| {
            let stage = self.files.get(*file).map(|entry| entry.stage());
            !matches!(stage, Some(Stage::Active(_)))
        };
        let waiting = self.errands.iter().filter(|(_, file)| waits(file));
        let waiting: Vec<(Ticket, FileId)> = waiting.map(|(it, file)| (*it, *file)).collect();
        for (ticket, file) in waiting {
            self.errands.remove(&ticket);
            self.files.remove(file);
            elsewhere(ticket, "the broker is stopping".to_owned(), actions);
        }
    }
}

fn elsewhere(ticket: Ticket, reason: String, actions: &mut Actions) {
    let response = Response::Elsewhere { reason };
    actions.push(Action::Answer { ticket, response });
}
