//! Files table: every known file with its state, and the queues of waiting files. A path is in the queue at most
//! once. A file that changes a hundred times while it waits is checked once, with its newest bytes.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::JobId;
use qcbus_types::{Judged, OnDemand, Reported, Stamp};

/// Index of a file in the table. It is never reused within a generation.
pub type FileId = u32;

/// Queue that a file waits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Priority {
    /// On-demand check: a client waits for exactly this file.
    OnDemand,
    /// New or changed file: a client waits for the verdict.
    Fresh,
    /// File with a verdict that is judged again because bundles or the configuration changed.
    Background,
}

/// Processing state of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stage {
    /// No work is pending.
    Idle,
    /// The file is in a queue since this time.
    Waiting(Priority, Duration),
    /// The file is being checked.
    Active(JobId),
}

/// A file in the table.
#[derive(Debug)]
pub struct FileEntry {
    /// Absolute path.
    pub path: Arc<Path>,
    /// File kind according to its name.
    pub kind: FileKind,
    /// The newest stamp seen.
    pub stamp: Stamp,
    /// Whether the file exists. A removed file stays in the table until its job has ended.
    pub present: bool,
    stage: Stage,
    /// The verdict is stale: the file changed during its check, or a file that it depends on
    /// changed. The verdict must not count as valid because of an unchanged stamp.
    pub stale: bool,
    /// An event reported the file with its present stamp while it was being read. For a young file
    /// this may mean another write.
    pub touched: bool,
    /// The accepted file was withdrawn from the gate until its acceptance is confirmed.
    pub unpublished: bool,
    /// Number of pending publications. The acceptance is not reported before they are done.
    pub opening: u32,
    /// The file is not processed before this time, because something failed for lack of room or disk space.
    pub not_before: Duration,
    /// The bus had no place for the file, and it waits for one.
    pub in_line: bool,
    /// Number of consecutive temporary failures to read the file.
    pub hindered: u32,
    /// The result contains outdated statements although no input of the verdict has changed. The
    /// file is checked again even if its inputs are unchanged.
    pub anew: bool,
    /// Writing a result has failed since the last verdict, so a result of other bytes may be in its place.
    pub half_written: bool,
    /// Time when the file was last queued, or requested while it waited. Data that is read for its
    /// verdict must not be older.
    pub asked: Duration,
    /// The verdict on some bytes, which may differ from the present ones.
    pub judged: Option<Arc<Judged>>,
    /// Other files that were read or looked up with it the last time, even if no verdict followed.
    depends_on: Vec<Arc<Path>>,
    /// State of each reporter for this file, by index into the reporters' table.
    pub delivered: Vec<(u32, Reported)>,
    /// The entry belongs to an on-demand check, and its outcome is not stored.
    pub on_demand: Option<OnDemand>,
}

impl FileEntry {
    /// Checks whether a reporter has the result of this job.
    pub fn has(&self, reporter: u32, job: JobId) -> bool {
        self.delivered.contains(&(reporter, Reported::Of(job)))
    }
}

/// The files table.
#[derive(Debug, Default)]
pub struct Files {
    entries: BTreeMap<FileId, FileEntry>,
    by_path: HashMap<Arc<Path>, FileId>,
    dependents: HashMap<Arc<Path>, Vec<FileId>>,
    /// Paths that lost their last dependent verdict since they were last taken.
    forgotten: BTreeSet<Arc<Path>>,
    next: FileId,
    on_demand_checks: VecDeque<FileId>,
    fresh: VecDeque<FileId>,
    background: VecDeque<FileId>,
    since_background: u8,
    /// The last dequeued file was an on-demand check.
    was_on_demand: bool,
    counts: Counts,
}

/// Number of files in each stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Files in the fresh queue or in the queue of on-demand checks.
    pub fresh: u64,
    /// Files in the background queue.
    pub background: u64,
    /// Files that are being checked.
    pub active: u64,
    /// All other files.
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

    /// Returns the stage of the file.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }
}

/// One in this many files comes from the background queue even if fresh files wait. Thus the
/// background queue progresses under permanent load.
const BACKGROUND_SHARE: u8 = 16;

impl Files {
    /// Returns the index of a path.
    pub fn id(&self, path: &Path) -> Option<FileId> {
        self.by_path.get(path).copied()
    }

    /// Returns an entry.
    pub fn get(&self, id: FileId) -> Option<&FileEntry> {
        self.entries.get(&id)
    }

    /// Returns an entry for changes.
    pub fn get_mut(&mut self, id: FileId) -> Option<&mut FileEntry> {
        self.entries.get_mut(&id)
    }

    /// Returns all entries in the order in which they were first seen.
    pub fn iter(&self) -> impl Iterator<Item = (FileId, &FileEntry)> {
        self.entries.iter().map(|(id, entry)| (*id, entry))
    }

    /// Adds a new file to the table.
    pub fn insert(&mut self, path: &Arc<Path>, kind: FileKind, stamp: Stamp) -> FileId {
        let id = self.add(FileEntry::new(path, kind, stamp));
        self.by_path.insert(path.clone(), id);
        id
    }

    /// Adds a file for an on-demand check. The entry cannot be found by its path, because a watched
    /// file may have the same path.
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

    /// Removes a file from the table.
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

    /// Puts an idle file into a queue. A file in the background queue moves to the fresh queue if
    /// the priority is fresh. The caller marks an active file as changed.
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

    /// Moves a waiting file to the front, because other files wait for its verdict.
    pub fn hurry(&mut self, id: FileId, now: Duration) {
        if matches!(
            self.entries.get(&id).map(FileEntry::stage),
            Some(Stage::Waiting(..))
        ) {
            self.set_stage(id, Stage::Waiting(Priority::Fresh, now));
            // Its old place in a queue becomes invalid.
            self.fresh.push_front(id);
        }
    }

    /// Moves a file to another stage. Only [`Files::enqueue`] and [`Files::dequeue`] change the queues themselves.
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

    /// Takes the next file that may be checked at `now`. Every second file is an on-demand check
    /// while any of them wait. Fresh files precede background files.
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
                // The file moved to another queue or was taken from it, so this place is invalid.
                _ => {}
            }
        }
        None
    }

    /// Checks whether no file is waiting or active.
    pub fn is_quiet(&self) -> bool {
        self.counts.fresh + self.counts.background + self.counts.active == 0
    }

    /// Returns the number of files in each stage.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns how long the file at the head of the fresh queue has waited.
    pub fn oldest_wait(&self, now: Duration) -> Duration {
        let waiting = |id: &FileId| match self.entries.get(id)?.stage {
            Stage::Waiting(Priority::Fresh, since) => Some(now.saturating_sub(since)),
            _ => None,
        };
        self.fresh.iter().find_map(waiting).unwrap_or_default()
    }

    /// Records the paths that a file depends on, so that [`Files::dependents`] finds it.
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

    /// Takes the paths that have lost their last dependent verdict since the last call.
    pub fn take_forgotten(&mut self) -> Vec<Arc<Path>> {
        std::mem::take(&mut self.forgotten).into_iter().collect()
    }

    /// Returns the files with a verdict that depends on this path, except the file itself.
    pub fn dependents(&self, path: &Path) -> Vec<FileId> {
        self.dependents.get(path).cloned().unwrap_or_default()
    }
}

#[cfg(test)]
#[path = "files_tests.rs"]
mod tests;
