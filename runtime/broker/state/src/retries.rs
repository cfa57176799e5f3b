//! Retries of failed reports: for example, the disk may have been full for a while.

use std::collections::BTreeSet;
use std::ops::Bound::{Excluded, Unbounded};
use std::time::Duration;

use super::files::FileId;

/// Number of reports that are retried at once to check whether the reporter works again. There may
/// be thousands of failed reports.
const PROBES: usize = 16;

/// Longest pause between two tries.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// Failed reports of one reporter. Some are retried after a pause, and all as soon as one retry succeeds.
#[derive(Debug, Default)]
pub(super) struct Retries {
    waiting: BTreeSet<FileId>,
    probed: BTreeSet<FileId>,
    /// The last file that was retried. The other files come first in the next round.
    last: FileId,
    pause: Duration,
    due: Option<Duration>,
}

impl Retries {
    /// Returns the number of reports that are not written.
    pub fn len(&self) -> usize {
        self.waiting.len() + self.probed.len()
    }

    /// Returns the time of the next retry.
    pub fn due(&self) -> Option<Duration> {
        self.due
    }

    /// Records a failed report. Returns whether it had not failed before.
    pub fn failed(&mut self, file: FileId, now: Duration, first_pause: Duration) -> bool {
        let is_new = !self.probed.remove(&file);
        self.waiting.insert(file);
        if self.due.is_none() {
            self.pause = (self.pause * 2).clamp(first_pause, LONGEST_PAUSE);
            self.due = Some(now + self.pause);
        }
        is_new
    }

    /// Records a written report. Returns the files to retry now.
    pub fn written(&mut self, file: FileId) -> BTreeSet<FileId> {
        if !self.probed.remove(&file) {
            self.forget(file);
            return BTreeSet::new();
        }
        (self.pause, self.due) = (Duration::ZERO, None);
        std::mem::take(&mut self.waiting)
    }

    /// Removes a file because it was removed, or because a newer result will be reported.
    pub fn forget(&mut self, file: FileId) {
        self.waiting.remove(&file);
        self.probed.remove(&file);
    }

    /// Returns the files to retry now.
    pub fn probes(&mut self, now: Duration) -> Vec<FileId> {
        // All files of the last round may have been removed.
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
    fn retry_pauses_double_up_to_a_minute() {
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
    fn few_failures_are_probed_and_success_retries_all() {
        let mut retries = Retries::default();
        for file in 0..100 {
            assert!(retries.failed(file, Duration::ZERO, FIRST));
        }
        let probes = retries.probes(seconds(1));
        assert_eq!(probes.len(), PROBES);
        for file in &probes {
            assert!(
                !retries.failed(*file, seconds(1), FIRST),
                "reported only once"
            );
        }
        let others = retries.probes(seconds(3));
        assert!(others.iter().all(|file| !probes.contains(file)));
        let rest = retries.written(others[0]);
        assert_eq!(rest.len(), 100 - PROBES);
        assert_eq!(retries.len(), PROBES - 1, "the other probes remain");
    }

    #[test]
    fn fresh_success_does_not_retry_failures() {
        let mut retries = Retries::default();
        retries.failed(1, Duration::ZERO, FIRST);
        assert!(retries.written(2).is_empty());
        assert_eq!(retries.probes(seconds(1)), [1]);
    }

    #[test]
    fn rest_is_retried_when_all_probes_are_gone() {
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
