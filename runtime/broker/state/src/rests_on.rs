//! Files that a file rests on: its map, its catalogs and the scenarios that it consists of.
//!
//! An accepted file can be run. Therefore its verdict is the worst of its own verdict and the verdicts of the files
//! that it rests on. Those verdicts may come earlier or later. A job with the answers of all bundles waits for them.
//! It moves these files to the front of the queue. If a verdict was given without one of them, or one has changed,
//! the verdict is given again. Thus it does not depend on the order of the files.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::JobId;
use qcbus_types::{Input, Judged, PreparedJob, Referenced, RestsOn};

use super::files::{FileEntry, FileId, Stage};
use super::jobs::{ActiveJob, JobStage};
use super::{Actions, State};

/// Maximum time that a job waits for the verdicts that its own verdict rests on. A cause of delay,
/// such as a hanging bundle, must not block the places of other jobs. After this time the verdict
/// is undetermined until the missing verdict comes.
const PATIENCE: Duration = Duration::from_secs(10);
/// The same limit in a run. A run reports each verdict once, so a later verdict would be lost. No job takes longer.
const PATIENCE_OF_A_RUN: Duration = Duration::from_secs(600);

impl State {
    /// Returns when a job with the answers of all bundles may be stored. This is at once, unless it waits for the
    /// verdict on a file that it rests on. Moves such files to the front of the queue.
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

    /// Returns the files that a job rests on if their verdicts are still expected.
    fn awaited_by(&self, id: JobId) -> Vec<Referenced> {
        let Some(job) = self.jobs.get(&id) else {
            return Vec::new();
        };
        if job.on_demand.is_some() {
            // A client's own run does not know the verdicts on other files.
            return Vec::new();
        }
        let Some(prepared) = &job.prepared else {
            return Vec::new();
        };
        let awaited = prepared.rests_on.iter();
        let awaited = awaited.filter(|it| self.may_come(it, prepared) && !self.waits_for(it, id));
        awaited.cloned().collect()
    }

    /// Checks whether a verdict on these bytes is still expected.
    fn may_come(&self, file: &Referenced, prepared: &PreparedJob) -> bool {
        let Some(entry) = self.entry_of(&file.path) else {
            // The file exists, but the watcher has not reported it yet. A run knows all its files after its scan.
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

    /// Checks whether a file itself waits for the verdict of a job, directly or indirectly. In a
    /// cycle of files one must come first.
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

    /// Also judges the files that the files of a run rest on, regardless of their location.
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

    /// Returns the files that a job rests on, each with its verdict.
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
        // A verdict of bundles that are not required now does not count.
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

    /// Checks whether all files that a verdict rests on still have the verdicts that were used.
    /// These must come from the bundles that are required now.
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

    /// Moves the files that an awaited verdict rests on to the front of the queue.
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

    /// Handles the end of the scan: all files are known, so no job waits for an unknown file any more.
    pub(super) fn all_are_known(&mut self) {
        let waiting: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in waiting {
            self.look_whether_to_wait(id);
        }
    }

    /// Judges files again that have used an outdated verdict on another file. This happens if a broker was killed
    /// between the two verdicts. Files that rest on a file without verdicts are judged again as well.
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

    /// Checks whether a verdict has used an outdated verdict on another file.
    pub(super) fn counted_otherwise(&self, judged: &Judged) -> bool {
        let mut under = judged.rests_on.iter().flatten();
        under.any(|it| {
            let judged = self.entry_of(&it.path).and_then(|it| it.judged.as_ref());
            judged.is_some_and(|judged| !says(judged, it))
        })
    }

    /// Checks whether a verdict rests on the same files as a job with the same bytes. For example,
    /// a map is not judged any more when its directory has become a symbolic link.
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

    /// Handles a confirmed verdict or the end of a job. The jobs and clients that waited for it are checked again.
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

    /// Ends jobs that wait in vain because the broker stops and judges no further files. They end
    /// without a verdict. The next broker judges their files.
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

    /// Checks whether a job has the answers of all bundles and waits for verdicts that its own rests on.
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

    /// Handles a new verdict on a file. Files that rest on it and have used another verdict are judged again.
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
                    // In an earlier stage the job reads the verdict when it finishes.
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

/// Checks whether a verdict belongs to the bytes that a job has read, including the common inputs.
/// The job may have read a newer part of a map than the verdict.
fn is_of(judged: &Judged, file: &Referenced, prepared: &PreparedJob) -> bool {
    let same = |input: &Input| {
        let mut read = prepared.inputs.iter();
        let read = read.find(|it| it.path == input.path);
        read.is_none_or(|it| it.digest() == input.digest())
    };
    judged.digest == file.digest && judged.inputs.iter().all(same)
}

/// Checks whether a verdict is the one that was used.
fn says(judged: &Judged, counted: &RestsOn) -> bool {
    judged.digest == counted.digest
        && Some(judged.verdict) == counted.verdict
        && judged.own_errors == counted.errors
}

/// Checks whether a verdict has used another verdict on this file than the present one.
fn counts_otherwise(judged: &Judged, path: &Arc<Path>, now: &Judged) -> bool {
    let Some(rests_on) = &judged.rests_on else {
        return true;
    };
    rests_on.iter().any(|it| it.path == *path && !says(now, it))
}
