//! What a file rests on: its map, catalogs that it takes entries from, scenarios that it is made of.
//!
//! Accepted means that the file can be run, so the verdict on it is the worst of its own and of the files that
//! it rests on. Those have verdicts of their own, which may come before or after it. A job whose bundles have
//! answered waits for them, and moves them to the front of the queue. A verdict that was given without one of
//! them, or with one that is another by now, is given anew. So the verdict does not depend on the order in
//! which files came.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::JobId;

use super::files::{FileEntry, FileId, Stage};
use super::jobs::{ActiveJob, JobStage};
use super::types::{Input, Judged, PreparedJob, Referenced, RestsOn};
use super::{Actions, State};

/// How long a job waits for the verdicts that its own rests on. What holds one up, such as a bundle that hangs,
/// must not hold the places of all others: after this time the verdict is undetermined, until the missing
/// verdict comes.
const PATIENCE: Duration = Duration::from_secs(10);
/// The same in a run, which tells each verdict once, so that nobody would read a later one. No job takes longer.
const PATIENCE_OF_A_RUN: Duration = Duration::from_secs(600);

impl State {
    /// Returns when a job whose bundles have answered may be stored: at once, unless it waits for the verdict on
    /// a file that it rests on. Moves such files to the front of the queue.
    pub(super) fn storable_at(&mut self, id: JobId) -> Duration {
        let waited: Vec<Referenced> = self.awaited_by(id);
        for file in &waited {
            if let Some(file) = self.files.id(&file.path) {
                self.files.hurry(file, self.now);
            }
        }
        match (waited.is_empty(), self.settings.once) {
            (true, _) => Duration::ZERO,
            (false, false) => self.now + PATIENCE,
            (false, true) => self.now + PATIENCE_OF_A_RUN,
        }
    }

    /// The files that a job rests on and whose verdicts are to be expected.
    fn awaited_by(&self, id: JobId) -> Vec<Referenced> {
        let Some(job) = self.jobs.get(&id) else {
            return Vec::new();
        };
        if job.on_demand.is_some() {
            // A client's run knows no verdicts of others.
            return Vec::new();
        }
        let Some(prepared) = &job.prepared else {
            return Vec::new();
        };
        let awaited = prepared.rests_on.iter();
        let awaited = awaited.filter(|it| self.may_come(it, prepared) && !self.waits_for(it, id));
        awaited.cloned().collect()
    }

    /// Whether a verdict on these bytes is to be expected.
    fn may_come(&self, file: &Referenced, prepared: &PreparedJob) -> bool {
        let Some(entry) = self.entry_of(&file.path) else {
            // It is there, and the watcher has not told of it yet. A run knows all its files after its look.
            return !(self.settings.once && self.scanned);
        };
        let judged = entry.judged.as_ref();
        let is_known = judged.is_some_and(|it| is_of(it, file, prepared));
        match entry.stage() {
            Stage::Active(_) => true,
            Stage::Waiting(..) => !is_known || entry.stale || !self.is_of_now(entry),
            Stage::Idle => !is_known || entry.stale,
        }
    }

    /// Whether a file waits itself for the verdict of a job, perhaps through others. Of files that rest on each
    /// other one must come first.
    fn waits_for(&self, file: &Referenced, id: JobId) -> bool {
        let mut open = vec![file.path.clone()];
        let mut seen = Vec::new();
        while let Some(path) = open.pop() {
            let Some(Stage::Active(other)) = self.entry_of(&path).map(FileEntry::stage) else {
                continue;
            };
            if *other == id {
                return true;
            }
            if seen.contains(other) {
                continue;
            }
            seen.push(*other);
            let job = self.jobs.get(other).filter(|_| self.is_held_up(*other));
            open.extend(
                job.into_iter()
                    .flat_map(referenced)
                    .map(|it| it.path.clone()),
            );
        }
        false
    }

    /// A run also judges what its files rest on, wherever that lies.
    pub(super) fn judge_what_is_under(&mut self, prepared: &PreparedJob, actions: &mut Actions) {
        if !self.settings.once || self.settings.own_verdicts {
            return;
        }
        for file in &prepared.rests_on {
            if self.files.id(&file.path).is_none() {
                let mut inputs = prepared.inputs.iter();
                let input = inputs.find(|it| it.path == file.path);
                let stamp = input.and_then(|it| it.content.stamp());
                self.settled(&file.path, stamp.unwrap_or_default(), actions);
            }
        }
    }

    /// The files that a job rests on, each with the verdict on it.
    pub(super) fn verdicts_under(&self, job: &ActiveJob) -> Vec<(Referenced, RestsOn)> {
        if job.on_demand.is_some() {
            return Vec::new();
        }
        let Some(prepared) = &job.prepared else {
            return Vec::new();
        };
        let verdicts = prepared.rests_on.iter();
        let verdicts = verdicts.map(|it| (it.clone(), self.verdict_under(it, prepared)));
        verdicts.collect()
    }

    fn verdict_under(&self, file: &Referenced, prepared: &PreparedJob) -> RestsOn {
        let entry = self
            .entry_of(&file.path)
            .filter(|it| it.present && !it.stale);
        // What others have judged who need not judge now counts for nobody.
        let entry = entry.filter(|it| self.is_of_now(it));
        let judged = entry.and_then(|it| it.judged.as_ref());
        let judged = judged.filter(|it| is_of(it, file, prepared));
        RestsOn {
            path: file.path.clone(),
            digest: file.digest,
            verdict: judged.map(|it| it.verdict),
            errors: judged.map_or(0, |it| it.own_errors),
        }
    }

    /// Whether all that a verdict rests on still has the verdict that was counted in, given by those who must
    /// judge now.
    pub(super) fn rests_firmly(&self, judged: &Judged) -> bool {
        if self.settings.own_verdicts {
            return true;
        }
        let firm = |it: &RestsOn| {
            self.entry_of(&it.path).is_some_and(|entry| {
                let same = entry.judged.as_ref().is_some_and(|judged| says(judged, it));
                same && entry.present && !entry.stale && self.is_of_now(entry)
            })
        };
        judged
            .rests_on
            .as_ref()
            .is_some_and(|all| all.iter().all(firm))
    }

    /// Somebody waits for a verdict: those that it rests on come at once.
    pub(super) fn hurry_under(&mut self, id: FileId) {
        let judged = self.files.get(id).and_then(|it| it.judged.clone());
        let under = judged
            .iter()
            .filter_map(|it| it.rests_on.as_ref())
            .flatten();
        for path in under.map(|it| it.path.clone()).collect::<Vec<_>>() {
            if let Some(file) = self.files.id(&path) {
                self.files.hurry(file, self.now);
            }
        }
    }

    fn is_of_now(&self, entry: &FileEntry) -> bool {
        let judged = entry.judged.as_ref();
        judged.is_some_and(|judged| self.stands(entry.kind, judged))
    }

    fn entry_of(&self, path: &Path) -> Option<&FileEntry> {
        self.files.get(self.files.id(path)?)
    }

    /// All files are known: jobs that waited for one which is none of them wait no longer.
    pub(super) fn all_are_known(&mut self) {
        let waiting: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in waiting {
            self.look_whether_to_wait(id);
        }
    }

    /// A broker may have been killed between a verdict and those of the files that rest on it: those that counted
    /// in another one are given anew. So are those that rest on a file which is not judged any more.
    pub(super) fn count_again(&mut self) {
        let files = self.files.iter().filter(|(_, entry)| entry.present);
        let outdated = files.filter(|(_, entry)| {
            let judged = entry.judged.as_ref();
            judged.is_some_and(|judged| {
                let mut under = judged.rests_on.iter().flatten();
                self.counted_otherwise(judged) || under.any(|it| self.entry_of(&it.path).is_none())
            })
        });
        let outdated: Vec<FileId> = outdated.map(|(id, _)| id).collect();
        for id in outdated {
            self.judge_anew(id);
        }
    }

    /// Whether a verdict counted in one on another file that has a different verdict by now.
    pub(super) fn counted_otherwise(&self, judged: &Judged) -> bool {
        let mut under = judged.rests_on.iter().flatten();
        under.any(|it| {
            let judged = self.entry_of(&it.path).and_then(|it| it.judged.as_ref());
            judged.is_some_and(|judged| !says(judged, it))
        })
    }

    /// Whether a verdict counted in those on the files that a job with the same bytes would count in. A map is judged
    /// no more, for instance, when its directory has become a symbolic link.
    pub(super) fn rests_on_the_same(&self, judged: &Judged, prepared: &PreparedJob) -> bool {
        if self.settings.own_verdicts {
            return true;
        }
        let now: BTreeSet<&Path> = prepared.rests_on.iter().map(|it| &*it.path).collect();
        let counted = judged.rests_on.as_ref();
        counted.is_some_and(|all| all.iter().map(|it| &*it.path).collect::<BTreeSet<_>>() == now)
    }

    pub(super) fn judge_anew(&mut self, id: FileId) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        (entry.stale, entry.anew) = (true, true);
        let path = entry.path.clone();
        let priority = self.priority_of(&path);
        self.files.enqueue(id, priority, self.now);
    }

    /// The verdict on a file stands, or its job is over: jobs and clients that waited for it look again.
    pub(super) fn verdict_has_come(&mut self, file: FileId, actions: &mut Actions) {
        for dependent in self.dependents_of(file) {
            match self.files.get(dependent).map(FileEntry::stage) {
                Some(Stage::Active(job)) => {
                    let job = *job;
                    self.look_whether_to_wait(job);
                }
                Some(_) => self.settle_waits(dependent, actions),
                None => {}
            }
        }
    }

    /// The broker stops, and no further file is judged: a job that waits for a verdict which does not come any more
    /// ends without one of its own. The next broker judges its file.
    pub(super) fn end_held_up(&mut self, actions: &mut Actions) {
        let comes = |file: &Referenced| {
            let stage = self.entry_of(&file.path).map(FileEntry::stage);
            matches!(stage, Some(Stage::Active(_)))
        };
        let held_up = self.jobs.keys().filter(|id| self.is_held_up(**id));
        let in_vain = held_up.filter(|id| !self.awaited_by(**id).iter().any(comes));
        for id in in_vain.copied().collect::<Vec<JobId>>() {
            self.begin_anew(id, actions);
        }
    }

    /// Whether the bundles have answered, and a job waits for the verdicts that its own rests on.
    pub(super) fn is_held_up(&self, id: JobId) -> bool {
        let job = self.jobs.get(&id);
        job.is_some_and(|job| matches!(job.stage, JobStage::Finished(at) if at > self.now))
    }

    fn look_whether_to_wait(&mut self, id: JobId) {
        if !self.is_held_up(id) || !self.awaited_by(id).is_empty() {
            return;
        }
        if let Some(job) = self.jobs.get_mut(&id) {
            job.stage = JobStage::Finished(Duration::ZERO);
        }
    }

    /// A file has a verdict: files that rest on it and counted in another one are judged anew.
    pub(super) fn counts_for_others(&mut self, file: FileId, now: &Judged) {
        let Some(path) = self.files.get(file).map(|entry| entry.path.clone()) else {
            return;
        };
        for dependent in self.dependents_of(file) {
            let Some(entry) = self.files.get_mut(dependent) else {
                continue;
            };
            match *entry.stage() {
                Stage::Active(job) => {
                    let job = self.jobs.get(&job);
                    // Before that it asks for the verdict when it comes to its end.
                    let is_late = job.is_some_and(|job| {
                        job.stage == JobStage::Storing && referenced(job).any(|it| it.path == path)
                    });
                    entry.stale |= is_late;
                    entry.anew |= is_late;
                }
                Stage::Idle | Stage::Waiting(..) => {
                    let judged = entry.judged.as_ref();
                    if entry.present && judged.is_some_and(|it| counts_otherwise(it, &path, now)) {
                        self.judge_anew(dependent);
                    }
                }
            }
        }
    }

    fn dependents_of(&self, file: FileId) -> Vec<FileId> {
        let path = self.files.get(file).map(|entry| entry.path.clone());
        path.map_or_else(Vec::new, |path| self.files.dependents(&path))
    }
}

fn referenced(job: &ActiveJob) -> impl Iterator<Item = &Referenced> {
    let prepared = job.prepared.iter();
    prepared.flat_map(|prepared| &prepared.rests_on)
}

/// Whether a verdict was given on the bytes that a job has read: those of the file, and those of what both depend
/// on. The job may have read a newer part of a map whose verdict is of the older one.
fn is_of(judged: &Judged, file: &Referenced, prepared: &PreparedJob) -> bool {
    let same = |input: &Input| {
        let mut read = prepared.inputs.iter();
        let read = read.find(|it| it.path == input.path);
        read.is_none_or(|it| it.digest() == input.digest())
    };
    judged.digest == file.digest && judged.inputs.iter().all(same)
}

/// Whether a verdict is the one that was counted in.
fn says(judged: &Judged, counted: &RestsOn) -> bool {
    judged.digest == counted.digest
        && Some(judged.verdict) == counted.verdict
        && judged.own_errors == counted.errors
}

/// Whether a verdict counted in another one on this file than it has now.
fn counts_otherwise(judged: &Judged, path: &Arc<Path>, now: &Judged) -> bool {
    let Some(rests_on) = &judged.rests_on else {
        return true;
    };
    rests_on.iter().any(|it| it.path == *path && !says(now, it))
}
