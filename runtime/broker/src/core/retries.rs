//! Reports that failed and are tried again: the disk may have had no room for a while.

use std::collections::BTreeSet;
use std::ops::Bound::{Excluded, Unbounded};
use std::time::Duration;

use super::files::FileId;

/// Reports that are tried at once, to see whether the reporter can work again. There may be thousands.
const PROBES: usize = 16;

/// Longest pause between two tries.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// What one reporter could not report. After a pause some of it is tried again; all of it as soon as one try
/// succeeds.
#[derive(Debug, Default)]
pub(super) struct Retries {
    waiting: BTreeSet<FileId>,
    probed: BTreeSet<FileId>,
    /// The last file that was probed: the others have their turn first.
    last: FileId,
    pause: Duration,
    due: Option<Duration>,
}

impl Retries {
    /// Reports that are not written.
    pub fn len(&self) -> usize {
        self.waiting.len() + self.probed.len()
    }

    /// When the next of them is tried.
    pub fn due(&self) -> Option<Duration> {
        self.due
    }

    /// A report failed. Returns whether it was none of those that had failed before.
    pub fn failed(&mut self, file: FileId, now: Duration, first_pause: Duration) -> bool {
        let is_new = !self.probed.remove(&file);
        self.waiting.insert(file);
        if self.due.is_none() {
            self.pause = (self.pause * 2).clamp(first_pause, LONGEST_PAUSE);
            self.due = Some(now + self.pause);
        }
        is_new
    }

    /// A report is written. Returns the files to be tried now.
    pub fn written(&mut self, file: FileId) -> BTreeSet<FileId> {
        if !self.probed.remove(&file) {
            self.forget(file);
            return BTreeSet::new();
        }
        (self.pause, self.due) = (Duration::ZERO, None);
        std::mem::take(&mut self.waiting)
    }

    /// A file has gone, or its newer result is to be reported.
    pub fn forget(&mut self, file: FileId) {
        self.waiting.remove(&file);
        self.probed.remove(&file);
    }

    /// The files to be tried again at this moment.
    pub fn probes(&mut self, now: Duration) -> Vec<FileId> {
        // Those that were probed may all have gone.
        let is_due = self.due.map_or(self.probed.is_empty(), |due| due <= now);
        if !is_due || self.waiting.is_empty() {
            return Vec::new();
        }
        self.due = None;
        let after = self.waiting.range((Excluded(self.last), Unbounded));
        let files: Vec<FileId> = after
            .chain(self.waiting.range(..=self.last))
            .take(PROBES)
            .copied()
            .collect();
        for file in &files {
            self.waiting.remove(file);
            self.probed.insert(*file);
            self.last = *file;
        }
        files
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: Duration = Duration::from_secs(1);

    fn seconds(number: u64) -> Duration {
        Duration::from_secs(number)
    }

    #[test]
    fn pauses_double_up_to_a_minute() {
        let mut retries = Retries::default();
        let mut now = Duration::ZERO;
        let mut pauses = Vec::new();
        for _ in 0..9 {
            retries.failed(1, now, FIRST);
            let due = retries.due().unwrap();
            assert!(retries.probes(due - Duration::from_millis(1)).is_empty());
            assert_eq!(retries.probes(due), [1]);
            pauses.push((due - now).as_secs());
            now = due;
        }
        assert_eq!(pauses, [1, 2, 4, 8, 16, 32, 60, 60, 60]);
    }

    #[test]
    fn few_of_many_are_probed_and_all_are_tried_when_one_succeeds() {
        let mut retries = Retries::default();
        for file in 0..100 {
            assert!(retries.failed(file, Duration::ZERO, FIRST));
        }
        let probes = retries.probes(seconds(1));
        assert_eq!(probes.len(), PROBES);
        for file in &probes {
            assert!(!retries.failed(*file, seconds(1), FIRST), "not said again");
        }
        let others = retries.probes(seconds(3));
        assert!(others.iter().all(|file| !probes.contains(file)));
        let rest = retries.written(others[0]);
        assert_eq!(rest.len(), 100 - PROBES);
        assert_eq!(retries.len(), PROBES - 1, "the others that are being tried");
    }

    #[test]
    fn fresh_success_does_not_try_what_failed() {
        let mut retries = Retries::default();
        retries.failed(1, Duration::ZERO, FIRST);
        assert!(retries.written(2).is_empty());
        assert_eq!(retries.probes(seconds(1)), [1]);
    }

    #[test]
    fn rest_is_tried_when_all_probes_have_gone() {
        let mut retries = Retries::default();
        for file in 0..=PROBES as FileId {
            retries.failed(file, Duration::ZERO, FIRST);
        }
        for file in retries.probes(seconds(1)) {
            retries.forget(file);
        }
        assert_eq!(retries.probes(seconds(1)).len(), 1);
    }
}
