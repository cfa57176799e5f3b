//! The work of a random world: files are read, results are written, and the broker is killed.

use std::path::Path;

use qcbus_messages::path_text::to_text;
use qcbus_messages::{DocId, DocumentRole, JobDocument, Verdict};
use qcbus_types::{FinishedJob, PrepareFailure, PreparedJob, Referenced, StoreOutcome};

use super::super::*;
use super::clients::Clients;
use super::things::*;
use super::world::World;

impl World {
    pub fn is_to_be_read(&mut self, job: JobId, path: &Path, waited: Duration) {
        self.waited.insert(job, waited);
        self.preparing.push((job, file_of(path)));
    }

    pub fn prepare(&mut self, n: u8, room: bool) {
        if self.preparing.is_empty() {
            return;
        }
        let (job, file) = self.preparing.remove(usize::from(n) % self.preparing.len());
        let inputs = self.inputs(file);
        let result = match inputs[0].digest() {
            None => Err(PrepareFailure::Vanished),
            Some(_) if !room => Err(PrepareFailure::NoRoom("full".to_owned())),
            Some(digest) => {
                let document = |role, input: &Input, digest| JobDocument {
                    doc: DocId(job.0),
                    role,
                    path: to_text(&input.path),
                    digest,
                    referred_at: 0,
                    links: Vec::new(),
                };
                let root = document(DocumentRole::Root, &inputs[0], digest);
                let maps = inputs[1..].iter().filter_map(|input| {
                    let digest = input.digest().filter(|_| file_of(&input.path) < 6)?;
                    Some(document(DocumentRole::Map, input, digest))
                });
                let documents = std::iter::once(root).chain(maps).collect();
                let rests_on = inputs[1..].iter().filter_map(|input| {
                    let digest = input.digest().filter(|_| file_of(&input.path) < 6)?;
                    Some(Referenced {
                        path: input.path.clone(),
                        digest,
                        role: DocumentRole::Map,
                        referred_at: 0,
                    })
                });
                let rests_on = rests_on.collect();
                Ok(Box::new(PreparedJob {
                    basis: basis(&inputs),
                    inputs,
                    racy: self.young,
                    documents,
                    missing: Vec::new(),
                    rests_on,
                    unwatched: Vec::new(),
                    bytes: 1,
                }))
            }
        };
        self.event(Event::Prepared { job, result });
    }

    pub fn store(&mut self, n: u8, room: bool) {
        self.write_out(n, room);
        while !self.told.is_empty() {
            self.tell();
        }
    }

    /// Notifies the state machine of a writer's result.
    pub fn tell(&mut self) {
        if !self.told.is_empty() {
            let ((_, job), outcome) = self.told.remove(0);
            self.event(Event::Stored { job, outcome });
        }
    }

    /// Lets a writer finish its work. The state machine is not yet notified.
    pub fn write_out(&mut self, n: u8, room: bool) {
        if self.storing.is_empty() {
            return;
        }
        let job = self.storing.remove(usize::from(n) % self.storing.len());
        let file = file_of(&job.path);
        let prepared = job.prepared.as_ref().unwrap();
        let outcome = if prepared.inputs != self.inputs(file) {
            StoreOutcome::Stale {
                half_written: false,
            }
        } else if job.epoch != self.state.epoch() {
            StoreOutcome::Outdated
        } else if !room {
            // The journal is written last, so an accepted file is already published.
            let failed = job.bundles.iter().any(|it| it.failure.is_some());
            let bad = self.rejected.contains(&file) || is_bad(prepared.root().unwrap().1);
            let under = job.rests_on.iter();
            let firm = under
                .clone()
                .all(|(_, it)| it.verdict == Some(Verdict::Accepted));
            if !failed && !bad && firm {
                self.gate.insert(file, prepared.inputs.clone());
            }
            StoreOutcome::Failed("full".to_owned())
        } else {
            self.stored.push(file);
            self.lost.remove(&file);
            let judged = self.judged(file, &job);
            self.must_be_earned(&judged);
            self.journal.insert(file, judged.clone());
            self.publish(file, &judged);
            StoreOutcome::Stored(Box::new(judged))
        };
        self.told.push(((file, job.job), outcome));
    }

    /// Returns the result of a writer for a job: the worst of the file's own verdict and of those that it rests on.
    fn judged(&mut self, file: u8, job: &FinishedJob) -> Judged {
        let (inputs, digest) = {
            let prepared = job.prepared.as_ref().unwrap();
            (prepared.inputs.clone(), prepared.root().unwrap().1)
        };
        let under = job.rests_on.iter();
        let rejected = under.filter(|(_, it)| it.verdict == Some(Verdict::Rejected));
        let maps = rejected.map(|(it, _)| file_of(&it.path)).collect();
        self.said_of_maps.insert(file, maps);
        let under = job.rests_on.iter().map(|(_, it)| it.verdict);
        let under = under.map(|it| it.unwrap_or(Verdict::Undetermined));
        let under = under.fold(Verdict::Accepted, Verdict::and);
        let names = job.bundles.iter().map(|it| it.name.clone());
        self.judges.insert(file, names.collect());
        let why = job.bundles.iter().filter_map(|it| it.failure.clone());
        let why: Vec<String> = why.collect();
        let failed = !why.is_empty();
        self.failures.insert(file, why);
        let own = match self.rejected.contains(&file) || is_bad(digest) {
            _ if failed => Verdict::Undetermined,
            true => Verdict::Rejected,
            false => Verdict::Accepted,
        };
        Judged {
            job: job.job,
            verdict: own.and(under),
            own,
            own_errors: u64::from(own == Verdict::Rejected),
            rests_on: Some(job.rests_on.iter().map(|(_, it)| it.clone()).collect()),
            digest,
            basis: job.prepared.as_ref().unwrap().basis,
            config: job.config,
            required_set: job.required_set.clone(),
            epoch: job.epoch,
            inputs,
            racy: false,
            counts: [0; 3],
            why: Vec::new(),
            xqar: Some("/out".into()),
        }
    }

    /// Kills the broker, changes a file, and starts the next broker from the journal. `unsettled`
    /// means that files may still be written to when they are first seen.
    pub fn restart_after(&mut self, file: u8, unsettled: bool) {
        self.stamps += 1;
        if self.there.remove(&path_of(file)).is_none() {
            self.contents.insert(self.stamps, self.stamps);
            self.there.insert(path_of(file), self.stamps);
        }
        self.restart_with(unsettled);
    }

    /// Kills the broker and starts the next one from the journal.
    pub fn restart(&mut self) {
        self.restart_with(false);
    }

    fn restart_with(&mut self, unsettled: bool) {
        self.generation += 1;
        self.state = fresh_state(self.generation, self.reconfigured);
        self.preparing.clear();
        self.storing.clear();
        self.peers.clear();
        self.launched.clear();
        self.dying.clear();
        self.waiting.clear();
        self.until.clear();
        self.told.clear();
        self.clients = Clients::default();
        self.judged.clear();
        // Every start checks the results before any file is judged.
        self.lost.clear();
        let unpublished = self.gate_is_taken_over();
        let known = self.journal.keys();
        self.watched = known
            .flat_map(|file| dependencies_of(*file).iter().copied())
            .collect();
        for member in self.members.values() {
            self.state.remember_member(member.clone());
        }
        for (file, judged) in self.journal.clone() {
            let mut judged = judged;
            // The engine does the same: it checks changes that happened without a broker again.
            judged.racy |= judged.inputs[1..] != self.inputs(file)[1..];
            let delivered = self.delivered(file);
            self.state.remember(&path_of(file), judged, &delivered);
        }
        for file in unpublished {
            self.state.remember_unpublished(&path_of(file));
        }
        self.reporter_restarts();
        self.children_are(self.manifest);
        let there = self.there.clone().into_iter();
        let there: Vec<_> = there.filter(|(path, _)| file_of(path) < 8).collect();
        if unsettled {
            for (path, _) in there.clone() {
                self.event(Event::Present { path });
            }
            self.event(Event::Scanned);
        }
        for (path, number) in there {
            let stamp = stamp(number);
            self.event(Event::Settled { path, stamp });
        }
        if !unsettled {
            self.event(Event::Scanned);
        }
    }
}
