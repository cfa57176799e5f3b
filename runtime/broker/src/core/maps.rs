//! Maps that are rejected themselves: a scenario on such a map says so, as information.
//!
//! The map is a file with a verdict of its own, which may come before or after that of the scenario. A
//! scenario whose map is under way waits a moment for it; whoever was judged before the map was rejected,
//! or on a map that no longer is, is judged again in the background. So what a result says does not
//! depend on the order in which files came.

use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::path_text::from_text;
use qcbus_messages::{DocumentRole, JobDocument, JobId, Verdict};

use super::State;
use super::files::{FileEntry, FileId, Priority, Stage};
use super::jobs::{ActiveJob, JobStage};
use super::types::{Judged, RejectedMap};

/// How long a scenario waits for the verdict on its map. That verdict counts for no more than an
/// information, so whatever holds the map up must not hold up the scenario.
const PATIENCE: Duration = Duration::from_secs(2);

impl State {
    /// When a job that is checked may be stored: at once, unless its map is under way.
    pub(super) fn storable_at(&self, job: &ActiveJob) -> Duration {
        if job.errand.is_some() {
            return Duration::ZERO;
        }
        if maps_of(job).any(|map| self.may_come(map)) {
            self.now + PATIENCE
        } else {
            Duration::ZERO
        }
    }

    /// Whether a verdict on this map is to be expected. A run that has an end waits for one whose turn it is not
    /// yet, and for one that it may find yet: it tells each verdict once, and nobody reads a second.
    fn may_come(&self, map: &JobDocument) -> bool {
        let once = self.settings.once;
        match self.entry_of(map).map(FileEntry::stage) {
            Some(Stage::Active(_)) => true,
            Some(Stage::Waiting(..)) => once,
            Some(Stage::Idle) => false,
            None => once && !self.scanned,
        }
    }

    /// All files are known: who waited for a map that is none of them waits no longer.
    pub(super) fn maps_are_known(&mut self) {
        let waits = |job: &ActiveJob| matches!(job.stage, JobStage::Finished(at) if at > self.now);
        let waiting = self.jobs.iter().filter(|(_, job)| waits(job));
        let in_vain = waiting.filter(|(_, job)| !maps_of(job).any(|map| self.may_come(map)));
        for id in in_vain.map(|(id, _)| *id).collect::<Vec<JobId>>() {
            if let Some(job) = self.jobs.get_mut(&id) {
                job.stage = JobStage::Finished(Duration::ZERO);
            }
        }
    }

    /// The maps of a job that were rejected, as the bytes that it was judged on.
    pub(super) fn rejected_maps(&self, job: &ActiveJob) -> Vec<RejectedMap> {
        // A run of one's own knows no verdicts of others.
        if job.errand.is_some() {
            return Vec::new();
        }
        let rejected = |map: &JobDocument| {
            let judged = self.entry_of(map)?.judged.as_ref()?;
            let is_it = judged.verdict == Verdict::Rejected && judged.digest == map.digest;
            is_it.then(|| RejectedMap {
                path: map.path.clone(),
                referred_at: map.referred_at,
                errors: judged.counts[0],
            })
        };
        maps_of(job).filter_map(rejected).collect()
    }

    fn entry_of(&self, map: &JobDocument) -> Option<&FileEntry> {
        self.files.get(self.files.id(&from_text(&map.path))?)
    }

    /// The job of a map is over: who waited for it waits no longer.
    pub(super) fn map_is_over(&mut self, map: FileId) {
        let Some(entry) = self.files.get(map).filter(|it| it.kind == FileKind::Xodr) else {
            return;
        };
        let path = entry.path.clone();
        for dependent in self.files.dependents(&path) {
            let stage = self.files.get(dependent).map(FileEntry::stage);
            let Some(Stage::Active(job)) = stage else {
                continue;
            };
            let waiting = self.jobs.get_mut(job);
            if let Some(waiting) = waiting.filter(|it| matches!(it.stage, JobStage::Finished(_))) {
                waiting.stage = JobStage::Finished(Duration::ZERO);
            }
        }
    }

    /// The verdict on a file is another than before: scenarios on it say so.
    pub(super) fn map_is_judged(&mut self, map: FileId, before: Option<&Judged>, now: &Judged) {
        let rejected = |judged: &Judged| judged.verdict == Verdict::Rejected;
        let Some(entry) = self.files.get(map).filter(|it| it.kind == FileKind::Xodr) else {
            return;
        };
        if before.is_some_and(rejected) == rejected(now) {
            return;
        }
        let path = entry.path.clone();
        for dependent in self.files.dependents(&path) {
            let Some(entry) = self.files.get_mut(dependent) else {
                continue;
            };
            match *entry.stage() {
                Stage::Active(job) => {
                    let stage = self.jobs.get(&job).map(|job| job.stage);
                    // Before that it asks for the verdict when it comes to its end.
                    let is_late = stage == Some(JobStage::Storing);
                    entry.doubted |= is_late;
                    entry.anew |= is_late;
                }
                Stage::Idle | Stage::Waiting(..) if entry.present && entry.judged.is_some() => {
                    (entry.doubted, entry.anew) = (true, true);
                    self.files
                        .enqueue(dependent, Priority::Background, self.now);
                }
                Stage::Idle | Stage::Waiting(..) => {}
            }
        }
    }
}

fn maps_of(job: &ActiveJob) -> impl Iterator<Item = &JobDocument> {
    let documents = job.prepared.iter().flat_map(|prepared| &prepared.documents);
    documents.filter(|document| document.role == DocumentRole::Map)
}
