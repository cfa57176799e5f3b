//! Detection of finished files. A file is finished immediately after a close or a rename into place. After any other
//! change it must be quiet for a while: same size and time, and no process has it open for writing.
//!
//! Events report a write and the following close. For files without events, `/proc` shows the processes that have
//! them open, as far as this user may see it. A lease would also work. While it is held, a writer that opens the file
//! without blocking, as FTP servers do, would be refused. The maximum wait without a change is [`OPEN_QUIET`]: a
//! process that keeps a file open for ever does not hide it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use qcbus_types::Stamp;

/// Files that were touched and may still be written to.
#[derive(Debug, Default)]
pub struct Settling {
    /// Configured quiet time. It also applies to closed files.
    asked: Option<Duration>,
    /// Pending files. The map is sorted, so that the order of reports is stable.
    pending: BTreeMap<PathBuf, Pending>,
}

#[derive(Debug)]
struct Pending {
    /// Time of the first change.
    since: Instant,
    /// Time of the last change.
    changed: Instant,
    due: Instant,
    stamp: Option<Stamp>,
    /// Whether the file was written to and not closed since then.
    is_open: bool,
    /// Whether the wait was reported.
    is_said: bool,
}

/// Default time for which a file must be quiet.
pub const QUIET: Duration = Duration::from_millis(250);

/// Time for which a file must be quiet that a process has open for writing.
pub const OPEN_QUIET: Duration = Duration::from_secs(60);

/// Interval of checks for processes that have a file open, if its close may cause no event.
const ASK_AGAIN: Duration = Duration::from_secs(1);

/// Reason why a file is not judged yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// The file is open for writing. The value is the maximum quiet time.
    Open(Duration),
    /// The file has changed and must be quiet for this time.
    Young(Duration),
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Why::Open(most) => write!(
                f,
                "it is open for writing; it is judged once it is closed, or has not changed for {} s",
                most.as_secs_f64()
            ),
            Why::Young(rest) => write!(
                f,
                "it is being written; it is judged once it has not changed for {} s",
                rest.as_secs_f64()
            ),
        }
    }
}

/// Result of a check of the due files.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Looked {
    /// Files that have settled.
    pub settled: Vec<PathBuf>,
    /// Files that wait longer than usual, each reported once, with their current stamps.
    pub waiting: Vec<(PathBuf, Option<Stamp>, Why)>,
}

impl Settling {
    /// Creates an empty set. `asked` is the quiet time, also for closed files.
    pub fn new(asked: Option<Duration>) -> Settling {
        Settling {
            asked,
            pending: BTreeMap::new(),
        }
    }

    /// Returns the time for which a file must be quiet.
    pub fn rest(&self) -> Duration {
        self.asked.unwrap_or(QUIET)
    }

    /// Returns the time for which a file that is open for writing must be quiet.
    pub fn open_rest(&self) -> Duration {
        self.rest().max(OPEN_QUIET)
    }

    /// Records a change that does not show whether the file is finished.
    pub fn touched(&mut self, path: &Path, stamp: Option<Stamp>, now: Instant) {
        let is_open = self.pending.get(path).is_some_and(|it| it.is_open);
        self.put(path, stamp, is_open, now);
    }

    /// Records a write. The writer must still close the file.
    pub fn written(&mut self, path: &Path, stamp: Option<Stamp>, now: Instant) {
        self.put(path, stamp, true, now);
    }

    /// Records the close of a file that was open for writing. Returns `false` if the file is finished.
    pub fn closed(&mut self, path: &Path, stamp: Option<Stamp>, now: Instant) -> bool {
        if self.asked.is_none() {
            self.done(path);
            return false;
        }
        self.put(path, stamp, false, now);
        true
    }

    fn put(&mut self, path: &Path, stamp: Option<Stamp>, is_open: bool, now: Instant) {
        let rest = if is_open {
            self.open_rest()
        } else {
            self.rest()
        };
        let before = self.pending.get(path);
        let pending = Pending {
            since: before.map_or(now, |it| it.since),
            changed: now,
            due: now + rest,
            stamp,
            is_open,
            is_said: before.is_some_and(|it| it.is_said),
        };
        self.pending.insert(path.to_path_buf(), pending);
    }

    /// Records a stamp from a scan. Scans may be more frequent than the quiet time, so only a
    /// change restarts the quiet time.
    pub fn seen(&mut self, path: &Path, stamp: Stamp, now: Instant) {
        let same = |pending: &Pending| pending.stamp == Some(stamp);
        if !self.pending.get(path).is_some_and(same) {
            self.touched(path, Some(stamp), now);
        }
    }

    /// Removes a file that is finished or gone.
    pub fn done(&mut self, path: &Path) {
        self.pending.remove(path);
    }

    /// Checks whether the file may still be written to.
    pub fn is_pending(&self, path: &Path) -> bool {
        self.pending.contains_key(path)
    }

    /// Treats all files as possibly closed, because the lost events may include their close.
    pub fn events_were_lost(&mut self, now: Instant) {
        let due = now + self.rest();
        for pending in self.pending.values_mut().filter(|it| it.is_open) {
            (pending.is_open, pending.due) = (false, due);
        }
    }

    /// Returns the time of the next check.
    pub fn next_due(&self) -> Option<Instant> {
        let times = self.pending.values().map(Pending::next_look);
        times.min()
    }

    /// Checks the due files. Unchanged files have settled. Files that have changed wait again, as
    /// well as files that `is_open` reports as open for writing.
    pub fn look(
        &mut self,
        now: Instant,
        mut stamp_of: impl FnMut(&Path) -> Option<Stamp>,
        mut is_open: impl FnMut(&Path) -> bool,
    ) -> Looked {
        let mut looked = Looked::default();
        let (rest, open_rest) = (self.rest(), self.open_rest());
        self.pending.retain(|path, pending| {
            if pending.next_look() > now {
                return true;
            }
            let mut why = if pending.is_open {
                Why::Open(open_rest)
            } else {
                Why::Young(rest)
            };
            if pending.due <= now {
                let stamp = stamp_of(path);
                let may_be_open = !pending.is_open && now < pending.changed + open_rest;
                if stamp != pending.stamp {
                    let quiet = if pending.is_open { open_rest } else { rest };
                    (pending.stamp, pending.changed, pending.due) = (stamp, now, now + quiet);
                } else if may_be_open && stamp.is_some() && is_open(path) {
                    pending.due = now + ASK_AGAIN;
                    why = Why::Open(open_rest);
                } else {
                    looked.settled.push(path.clone());
                    return false;
                }
            }
            if !std::mem::replace(&mut pending.is_said, true) {
                looked.waiting.push((path.clone(), pending.stamp, why));
            }
            true
        });
        looked
    }
}

impl Pending {
    /// Returns the time at which the file is due, or at which its wait must be reported.
    fn next_look(&self) -> Instant {
        if self.is_said {
            return self.due;
        }
        self.due.min(self.since + QUIET)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: fn() -> Instant = Instant::now;

    fn stamp(size: u64) -> Stamp {
        Stamp {
            size,
            ..Stamp::default()
        }
    }

    fn path() -> &'static Path {
        Path::new("/a.xodr")
    }

    /// Returns the result of a check for a file of this size, which may be open.
    fn look(settling: &mut Settling, now: Instant, size: u64, is_open: bool) -> Looked {
        settling.look(now, |_| Some(stamp(size)), |_| is_open)
    }

    #[test]
    fn frequent_scans_do_not_delay_settling() {
        let start = NOW();
        let mut settling = Settling::default();
        settling.seen(path(), stamp(1), start);
        settling.seen(path(), stamp(1), start + QUIET / 2);
        assert_eq!(settling.next_due(), Some(start + QUIET));
        settling.seen(path(), stamp(2), start + QUIET / 2);
        let looked = look(&mut settling, start + QUIET, 2, false);
        assert_eq!(looked.settled, [] as [&Path; 0]);
        assert_eq!(settling.next_due(), Some(start + QUIET / 2 + QUIET));
        settling.touched(path(), Some(stamp(2)), start + QUIET);
        assert_eq!(settling.next_due(), Some(start + QUIET * 2));
    }

    #[test]
    fn growing_file_is_reported_once_as_waiting() {
        let start = NOW();
        let mut settling = Settling::default();
        settling.touched(path(), Some(stamp(1)), start);
        assert_eq!(look(&mut settling, start, 1, false), Looked::default());
        let grown = look(&mut settling, start + QUIET, 2, false);
        let young = (path().to_path_buf(), Some(stamp(2)), Why::Young(QUIET));
        assert_eq!((grown.settled.len(), grown.waiting), (0, vec![young]));
        let settled = look(&mut settling, start + QUIET * 2, 2, false);
        assert_eq!(
            (settled.settled, settled.waiting.len()),
            (vec![path().to_path_buf()], 0)
        );
        assert_eq!(settling.next_due(), None);
    }

    #[test]
    fn written_file_waits_for_its_close_within_the_limit() {
        let start = NOW();
        let mut settling = Settling::default();
        settling.written(path(), Some(stamp(1)), start);
        let looked = look(&mut settling, start + QUIET, 1, false);
        let open = (path().to_path_buf(), Some(stamp(1)), Why::Open(OPEN_QUIET));
        assert_eq!((looked.settled.len(), looked.waiting), (0, vec![open]));
        let before = start + OPEN_QUIET - QUIET;
        assert_eq!(look(&mut settling, before, 1, false), Looked::default());
        // A change of attributes does not show a close.
        settling.touched(path(), Some(stamp(1)), before);
        let looked = look(&mut settling, start + OPEN_QUIET, 1, false);
        assert_eq!(looked, Looked::default());
        let looked = look(&mut settling, before + OPEN_QUIET, 1, false);
        assert_eq!(looked.settled, [path()]);
        settling.written(path(), Some(stamp(2)), start);
        assert!(!settling.closed(path(), Some(stamp(2)), start));
        assert_eq!(settling.next_due(), None);
    }

    #[test]
    fn file_open_in_another_process_is_checked_again() {
        let start = NOW();
        let mut settling = Settling::default();
        settling.seen(path(), stamp(1), start);
        let looked = look(&mut settling, start + QUIET, 1, true);
        assert_eq!((looked.settled.len(), looked.waiting.len()), (0, 1));
        let next = start + QUIET + ASK_AGAIN;
        assert_eq!(settling.next_due(), Some(next));
        assert_eq!(look(&mut settling, next, 1, true), Looked::default());
        assert_eq!(
            look(&mut settling, next + ASK_AGAIN, 1, false).settled,
            [path()]
        );
        settling.seen(path(), stamp(1), start);
        assert_eq!(
            look(&mut settling, start + OPEN_QUIET, 1, true).settled,
            [path()]
        );
    }

    #[test]
    fn files_are_reported_in_order() {
        let start = NOW();
        let names: Vec<PathBuf> = (0..20).map(|it| format!("/{it:02}.xodr").into()).collect();
        let mut settling = Settling::default();
        for name in names.iter().rev() {
            settling.touched(name, Some(stamp(1)), start);
        }
        let grown = look(&mut settling, start + QUIET, 2, false);
        let waiting: Vec<PathBuf> = grown.waiting.into_iter().map(|it| it.0).collect();
        assert_eq!(waiting, names);
        let looked = look(&mut settling, start + QUIET * 2, 2, false);
        assert_eq!(looked.settled, names);
    }

    #[test]
    fn requested_settle_time_also_counts_after_a_close() {
        let start = NOW();
        let rest = Duration::from_secs(30);
        let mut settling = Settling::new(Some(rest));
        settling.written(path(), Some(stamp(1)), start);
        assert!(settling.closed(path(), Some(stamp(2)), start));
        let looked = look(&mut settling, start + QUIET, 2, false);
        assert_eq!(looked.waiting[0].2, Why::Young(rest));
        assert_eq!(
            look(&mut settling, start + rest, 2, false).settled,
            [path()]
        );
    }

    #[test]
    fn lost_events_may_include_the_close() {
        let start = NOW();
        let mut settling = Settling::default();
        settling.written(path(), Some(stamp(1)), start);
        settling.events_were_lost(start);
        assert_eq!(
            look(&mut settling, start + QUIET, 1, false).settled,
            [path()]
        );
    }
}
