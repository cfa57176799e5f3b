//! The files table: every file that is present, what is known of it, and the queue of those that
//! wait. A path is in the queue at most once, so a file that changes a hundred times while it
//! waits is checked once, with its newest bytes.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::JobId;

use super::on_demand::OnDemand;
use super::types::{Judged, Reported, Stamp};

/// Index of a file in the table; never reused within a generation.
pub type FileId = u32;

/// Which queue a file waits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Priority {
    /// Asked for by somebody who waits for it and for nothing else.
    OnDemand,
    /// New or changed: somebody waits for the verdict.
    Fresh,
    /// Judged already, to be judged again because bundles or configuration changed.
    Background,
}

/// Where a file stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stage {
    /// Nothing to do.
    Idle,
    /// In a queue since then.
    Waiting(Priority, Duration),
    /// Being checked.
    Active(JobId),
}

/// One file.
#[derive(Debug)]
pub struct FileEntry {
    /// Absolute path.
    pub path: Arc<Path>,
    /// What its name promises.
    pub kind: FileKind,
    /// The newest stamp seen.
    pub stamp: Stamp,
    /// Whether it is there; a file that has gone stays in the table until its job has ended.
    pub present: bool,
    stage: Stage,
    /// It changed while it was being checked, or something that it depends on changed at any time:
    /// its verdict must not be taken to stand because its stamp is the same.
    pub stale: bool,
    /// An event told of it while it was being read, under the stamp that it has: of a young file that
    /// is what another write looks like.
    pub touched: bool,
    /// What it is accepted for was taken from behind the gate, until it is known to stand.
    pub unpublished: bool,
    /// How many times it is about to be published again: nobody is told before that it is accepted.
    pub opening: u32,
    /// Not before then, after something failed for want of room or disk.
    pub not_before: Duration,
    /// The bus had no place for it, and it waits for one.
    pub in_line: bool,
    /// How often in a row something that passes kept it from being read.
    pub hindered: u32,
    /// Its result says something that is so no more, though nothing that its verdict depends on has
    /// changed: it is checked again even if it is read as before.
    pub anew: bool,
    /// Writing a result has failed since the last verdict, so one of other bytes may lie in its place.
    pub half_written: bool,
    /// When something last made it wait, or somebody asked for it while it did: what is read for its
    /// verdict must not be older.
    pub asked: Duration,
    /// The verdict on some bytes, not always the present ones.
    pub judged: Option<Arc<Judged>>,
    /// What else was read with it, or looked for, the last time; also where no verdict came of it.
    depends_on: Vec<Arc<Path>>,
    /// What reporters have said of it, by index into the reporters' table.
    pub delivered: Vec<(u32, Reported)>,
    /// It is here for a client that waits for its result, and nothing of it is kept.
    pub on_demand: Option<OnDemand>,
}

impl FileEntry {
    /// Whether a reporter has the result of this job.
    pub fn has(&self, reporter: u32, job: JobId) -> bool {
        self.delivered.contains(&(reporter, Reported::Of(job)))
    }
}

/// The table.
#[derive(Debug, Default)]
pub struct Files {
    entries: BTreeMap<FileId, FileEntry>,
    by_path: HashMap<Arc<Path>, FileId>,
    dependents: HashMap<Arc<Path>, Vec<FileId>>,
    /// Paths that nobody depends on any more, until somebody asks.
    forgotten: BTreeSet<Arc<Path>>,
    next: FileId,
    on_demand_checks: VecDeque<FileId>,
    fresh: VecDeque<FileId>,
    background: VecDeque<FileId>,
    since_background: u8,
    /// The last that was taken was an errand.
    was_on_demand: bool,
    counts: Counts,
}

/// How many files are in which stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// In the fresh queue, or for an errand.
    pub fresh: u64,
    /// In the background queue.
    pub background: u64,
    /// Being checked.
    pub active: u64,
    /// Neither.
    pub idle: u64,
}

impl Counts {
    fn of(&mut self, stage: &Stage) -> &mut u64 {
        match stage {
            Stage::Idle => &mut self.idle,
            Stage::Waiting(Priority::OnDemand | Priority::Fresh, _) => &mut self.fresh,
            Stage::Waiting(Priority::Background, _) => &mut self.background,
            Stage::Active(_) => &mut self.active,
        }
    }
}

impl FileEntry {
    fn new(path: &Arc<Path>, kind: FileKind, stamp: Stamp) -> FileEntry {
        FileEntry {
            path: path.clone(),
            kind,
            stamp,
            present: true,
            stage: Stage::Idle,
            stale: false,
            touched: false,
            unpublished: false,
            opening: 0,
            anew: false,
            half_written: false,
            not_before: Duration::ZERO,
            in_line: false,
            hindered: 0,
            asked: Duration::ZERO,
            judged: None,
            depends_on: Vec::new(),
            delivered: Vec::new(),
            on_demand: None,
        }
    }

    /// Where it stands.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }
}

/// One in this many files comes from the background even when fresh ones wait, so that the
/// background gets on while a farm never rests.
const BACKGROUND_SHARE: u8 = 16;

impl Files {
    /// The entry of a path.
    pub fn id(&self, path: &Path) -> Option<FileId> {
        self.by_path.get(path).copied()
    }

    /// The entry.
    pub fn get(&self, id: FileId) -> Option<&FileEntry> {
        self.entries.get(&id)
    }

    /// The entry, to change.
    pub fn get_mut(&mut self, id: FileId) -> Option<&mut FileEntry> {
        self.entries.get_mut(&id)
    }

    /// All entries in the order in which they were first seen.
    pub fn iter(&self) -> impl Iterator<Item = (FileId, &FileEntry)> {
        self.entries.iter().map(|(id, entry)| (*id, entry))
    }

    /// Adds a file that is not yet in the table.
    pub fn insert(&mut self, path: &Arc<Path>, kind: FileKind, stamp: Stamp) -> FileId {
        let id = self.add(FileEntry::new(path, kind, stamp));
        self.by_path.insert(path.clone(), id);
        id
    }

    /// Adds a file for an errand. Nobody finds it by its path, under which another may be watched.
    pub fn insert_on_demand(
        &mut self,
        path: &Arc<Path>,
        kind: FileKind,
        on_demand: OnDemand,
    ) -> FileId {
        self.add(FileEntry {
            on_demand: Some(on_demand),
            ..FileEntry::new(path, kind, Stamp::default())
        })
    }

    fn add(&mut self, entry: FileEntry) -> FileId {
        let id = self.next;
        self.next += 1;
        self.counts.idle += 1;
        self.entries.insert(id, entry);
        id
    }

    /// Forgets a file for good.
    pub fn remove(&mut self, id: FileId) {
        self.set_dependencies(id, Vec::new());
        self.set_stage(id, Stage::Idle);
        if let Some(entry) = self.entries.remove(&id) {
            self.counts.idle -= 1;
            if self.by_path.get(&entry.path) == Some(&id) {
                self.by_path.remove(&entry.path);
            }
        }
    }

    /// Puts an idle file into a queue; one that waits in the background moves up when fresh.
    /// An active one is marked as changed by the caller, not here.
    pub fn enqueue(&mut self, id: FileId, priority: Priority, now: Duration) {
        if let Some(entry) = self.entries.get_mut(&id) {
            entry.asked = now;
        }
        match self.entries.get(&id).map(|entry| &entry.stage) {
            Some(Stage::Idle | Stage::Waiting(Priority::Background, _))
                if priority == Priority::Fresh =>
            {
                self.set_stage(id, Stage::Waiting(Priority::Fresh, now));
                self.fresh.push_back(id);
            }
            Some(Stage::Idle) => {
                self.set_stage(id, Stage::Waiting(priority, now));
                self.queue(priority).push_back(id);
            }
            _ => {}
        }
    }

    /// Moves a file that waits to the front: others wait for the verdict on it.
    pub fn hurry(&mut self, id: FileId, now: Duration) {
        if matches!(
            self.entries.get(&id).map(FileEntry::stage),
            Some(Stage::Waiting(..))
        ) {
            self.set_stage(id, Stage::Waiting(Priority::Fresh, now));
            // Its other place in a queue is void.
            self.fresh.push_front(id);
        }
    }

    /// Moves a file to another stage; the queues themselves are the business of
    /// [`Files::enqueue`] and [`Files::dequeue`].
    pub fn set_stage(&mut self, id: FileId, stage: Stage) {
        let Some(entry) = self.entries.get_mut(&id) else {
            return;
        };
        *self.counts.of(&entry.stage) -= 1;
        *self.counts.of(&stage) += 1;
        entry.stage = stage;
    }

    fn queue(&mut self, priority: Priority) -> &mut VecDeque<FileId> {
        match priority {
            Priority::OnDemand => &mut self.on_demand_checks,
            Priority::Fresh => &mut self.fresh,
            Priority::Background => &mut self.background,
        }
    }

    /// Takes the next file that may be checked at `now`: every other one is an errand while there are any, and
    /// the fresh come before the background.
    pub fn dequeue(&mut self, now: Duration) -> Option<FileId> {
        let mut order = [Priority::Fresh, Priority::Background];
        if self.since_background >= BACKGROUND_SHARE {
            order.reverse();
        }
        let [first, second] = order;
        let order = match self.was_on_demand {
            true => [first, second, Priority::OnDemand],
            false => [Priority::OnDemand, first, second],
        };
        order
            .into_iter()
            .find_map(|priority| self.dequeue_from(priority, now))
    }

    fn dequeue_from(&mut self, priority: Priority, now: Duration) -> Option<FileId> {
        for _ in 0..self.queue(priority).len() {
            let id = self.queue(priority).pop_front()?;
            let Some(entry) = self.entries.get(&id) else {
                continue;
            };
            match entry.stage {
                Stage::Waiting(at, _) if at == priority && entry.not_before <= now => {
                    self.set_stage(id, Stage::Idle);
                    self.was_on_demand = priority == Priority::OnDemand;
                    self.since_background = match priority {
                        Priority::OnDemand => self.since_background,
                        Priority::Fresh => self.since_background.saturating_add(1),
                        Priority::Background => 0,
                    };
                    return Some(id);
                }
                Stage::Waiting(at, _) if at == priority => self.queue(priority).push_back(id),
                // It moved to the other queue, or was taken from it: this place is void.
                _ => {}
            }
        }
        None
    }

    /// Whether nothing waits and nothing is active.
    pub fn is_quiet(&self) -> bool {
        self.counts.fresh + self.counts.background + self.counts.active == 0
    }

    /// How many files are in which stage.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// How long the file at the head of the fresh queue has waited.
    pub fn oldest_wait(&self, now: Duration) -> Duration {
        let waiting = |id: &FileId| match self.entries.get(id)?.stage {
            Stage::Waiting(Priority::Fresh, since) => Some(now.saturating_sub(since)),
            _ => None,
        };
        self.fresh.iter().find_map(waiting).unwrap_or_default()
    }

    /// Remembers what a file depends on, so that [`Files::dependents`] finds it.
    pub fn set_dependencies(&mut self, id: FileId, new: Vec<Arc<Path>>) {
        let Some(entry) = self.entries.get_mut(&id) else {
            return;
        };
        let old = std::mem::replace(&mut entry.depends_on, new.clone());
        for path in old {
            self.forget_dependent(&path, id);
        }
        for path in new {
            self.forgotten.remove(&path);
            let ids = self.dependents.entry(path).or_default();
            if !ids.contains(&id) {
                ids.push(id);
            }
        }
    }

    fn forget_dependent(&mut self, path: &Path, id: FileId) {
        if let Some(ids) = self.dependents.get_mut(path) {
            ids.retain(|other| *other != id);
            if ids.is_empty()
                && let Some((path, _)) = self.dependents.remove_entry(path)
            {
                self.forgotten.insert(path);
            }
        }
    }

    /// The paths that nobody depends on any more, since this was last asked.
    pub fn take_forgotten(&mut self) -> Vec<Arc<Path>> {
        std::mem::take(&mut self.forgotten).into_iter().collect()
    }

    /// The files whose verdict depends on this path (other than the file itself).
    pub fn dependents(&self, path: &Path) -> Vec<FileId> {
        self.dependents.get(path).cloned().unwrap_or_default()
    }
}

#[cfg(test)]
#[path = "files_tests.rs"]
mod tests;
