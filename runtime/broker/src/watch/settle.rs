//! When is a file finished? After a close or a rename into place at once; after anything else when
//! it has been quiet for a while and neither its size nor its time has moved.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::core::Stamp;

/// Files that have been touched and may still be written to.
#[derive(Debug, Default)]
pub struct Settling {
    pending: HashMap<PathBuf, Pending>,
}

#[derive(Debug)]
struct Pending {
    due: Instant,
    stamp: Option<Stamp>,
}

/// How long a file must be quiet.
pub const QUIET: Duration = Duration::from_millis(250);

impl Settling {
    /// The file was touched in a way that does not say that it is finished.
    pub fn touched(&mut self, path: &Path, stamp: Option<Stamp>, now: Instant) {
        self.pending.insert(
            path.to_path_buf(),
            Pending {
                due: now + QUIET,
                stamp,
            },
        );
    }

    /// The file was seen in passing, which may happen more often than every quiet time: only a
    /// change starts its quiet time anew.
    pub fn seen(&mut self, path: &Path, stamp: Stamp, now: Instant) {
        let same = |pending: &Pending| pending.stamp == Some(stamp);
        if !self.pending.get(path).is_some_and(same) {
            self.touched(path, Some(stamp), now);
        }
    }

    /// The file is finished or gone: nothing to wait for.
    pub fn done(&mut self, path: &Path) {
        self.pending.remove(path);
    }

    /// When to look next.
    pub fn next_due(&self) -> Option<Instant> {
        self.pending.values().map(|pending| pending.due).min()
    }

    /// The files that are due and have kept still; those that moved meanwhile wait again.
    pub fn settled(
        &mut self,
        now: Instant,
        mut stamp_of: impl FnMut(&Path) -> Option<Stamp>,
    ) -> Vec<PathBuf> {
        let mut settled = Vec::new();
        self.pending.retain(|path, pending| {
            if pending.due > now {
                return true;
            }
            let stamp = stamp_of(path);
            if stamp == pending.stamp {
                settled.push(path.clone());
                return false;
            }
            *pending = Pending {
                due: now + QUIET,
                stamp,
            };
            true
        });
        settled.sort();
        settled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looking_often_does_not_keep_a_file_from_settling() {
        let start = Instant::now();
        let stamp = |size| Stamp {
            size,
            ..Stamp::default()
        };
        let mut settling = Settling::default();
        let path = Path::new("/a.xodr");
        settling.seen(path, stamp(1), start);
        settling.seen(path, stamp(1), start + QUIET / 2);
        assert_eq!(settling.next_due(), Some(start + QUIET));
        settling.seen(path, stamp(2), start + QUIET / 2);
        assert_eq!(settling.next_due(), Some(start + QUIET / 2 + QUIET));
        settling.touched(path, Some(stamp(2)), start + QUIET);
        assert_eq!(settling.next_due(), Some(start + QUIET * 2));
    }

    #[test]
    fn a_file_that_grows_is_not_settled() {
        let start = Instant::now();
        let stamp = |size| {
            Some(Stamp {
                size,
                ..Stamp::default()
            })
        };
        let mut settling = Settling::default();
        let path = Path::new("/a.xodr");
        settling.touched(path, stamp(1), start);
        assert!(settling.settled(start, |_| stamp(1)).is_empty());
        assert!(settling.settled(start + QUIET, |_| stamp(2)).is_empty());
        assert_eq!(settling.settled(start + QUIET * 2, |_| stamp(2)), [path]);
        assert_eq!(settling.next_due(), None);
    }
}
