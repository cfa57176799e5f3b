//! Queue of directories to scan: those with an event, and all directories at intervals. Each is
//! queued once, so a directory with many events cannot delay the others.

use std::collections::{HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Minimum pause between two full scans...
const PAUSE: Duration = Duration::from_millis(100);

/// ...and minimum pause as a multiple of the duration of the last full scan.
const SHARE: u32 = 4;

/// The next directory to scan.
#[derive(Debug, PartialEq, Eq)]
pub enum Turn {
    /// An event has happened in the directory, or may have.
    Told(PathBuf),
    /// The directory is the next one of a full scan.
    Passed {
        /// The directory.
        directory: PathBuf,
        /// Whether this is the first full scan.
        first: bool,
    },
}

/// A full scan.
#[derive(Debug)]
struct Pass {
    first: bool,
    began: Instant,
    directories: VecDeque<PathBuf>,
}

/// Queue of directories to scan.
#[derive(Debug)]
pub struct Due {
    told: VecDeque<PathBuf>,
    queued: HashSet<PathBuf>,
    pass: Option<Pass>,
    is_passed_next: bool,
    next_pass: Instant,
    /// Earliest time of the next full scan.
    rest: Instant,
}

impl Due {
    /// Creates a queue in which only the first full scan is due, now.
    pub fn new(now: Instant) -> Due {
        Due {
            told: VecDeque::new(),
            queued: HashSet::new(),
            pass: None,
            is_passed_next: false,
            next_pass: now,
            rest: now,
        }
    }

    /// Queues a directory for a scan.
    pub fn push(&mut self, directory: &Path) {
        if !self.queued.contains(directory) {
            self.queued.insert(directory.to_path_buf());
            self.told.push_back(directory.to_path_buf());
        }
    }

    /// Adds a directory that was found in a full scan to that scan.
    pub fn pass_on(&mut self, directory: PathBuf) {
        if let Some(pass) = &mut self.pass {
            pass.directories.push_back(directory);
        }
    }

    /// Checks whether a directory will be scanned without a further event.
    pub fn covers(&self, directory: &Path) -> bool {
        self.pass.is_some() || self.queued.contains(directory)
    }

    /// Checks whether no directory has to be scanned now.
    pub fn is_empty(&self) -> bool {
        self.told.is_empty() && self.pass.is_none()
    }

    /// Starts a full scan.
    pub fn begin_pass(&mut self, roots: &[PathBuf], first: bool, now: Instant) {
        self.pass = Some(Pass {
            first,
            began: now,
            directories: roots.iter().cloned().collect(),
        });
        self.next_pass = now + Duration::from_secs(u64::from(u32::MAX));
    }

    /// Returns the time of the next full scan, or `None` during a full scan.
    pub fn next_pass(&self) -> Option<Instant> {
        self.pass.is_none().then_some(self.next_pass.max(self.rest))
    }

    /// Schedules a full scan at that time at the latest.
    pub fn pass_at(&mut self, at: Instant) {
        self.next_pass = self.next_pass.min(at);
    }

    /// Returns the next directory. Directories with events and those of a full scan alternate.
    pub fn next(&mut self) -> Option<Turn> {
        self.is_passed_next = !self.is_passed_next;
        if self.is_passed_next {
            self.next_passed().or_else(|| self.next_told())
        } else {
            self.next_told().or_else(|| self.next_passed())
        }
    }

    fn next_told(&mut self) -> Option<Turn> {
        let directory = self.told.pop_front()?;
        self.queued.remove(&directory);
        Some(Turn::Told(directory))
    }

    fn next_passed(&mut self) -> Option<Turn> {
        let pass = self.pass.as_mut()?;
        let (directory, first) = (pass.directories.pop_front()?, pass.first);
        Some(Turn::Passed { directory, first })
    }

    /// Returns a value if a full scan has just ended: whether it was the first.
    pub fn ended_pass(&mut self, now: Instant) -> Option<bool> {
        let pass = self.pass.take_if(|pass| pass.directories.is_empty())?;
        let took = now.saturating_duration_since(pass.began);
        self.rest = now + PAUSE.max(took * SHARE);
        Some(pass.first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(name: &str) -> Option<Turn> {
        Some(Turn::Told(name.into()))
    }

    #[test]
    fn repeatedly_pushed_directory_waits_behind_others() {
        let mut due = Due::new(Instant::now());
        for name in ["a", "b", "a", "a", "c"] {
            due.push(Path::new(name));
        }
        assert_eq!(due.next(), told("a"));
        due.push(Path::new("a"));
        assert_eq!(
            [due.next(), due.next(), due.next()],
            ["b", "c", "a"].map(told)
        );
        assert!(due.next().is_none() && due.is_empty());
    }

    #[test]
    fn full_pass_and_events_take_turns() {
        let now = Instant::now();
        let mut due = Due::new(now);
        assert_eq!(due.next_pass(), Some(now));
        due.begin_pass(&["r".into()], true, now);
        assert_eq!(due.next_pass(), None);
        due.pass_on("s".into());
        due.push(Path::new("a"));
        due.push(Path::new("b"));
        let turns: Vec<Turn> = std::iter::from_fn(|| due.next()).collect();
        let names = turns.iter().map(|turn| match turn {
            Turn::Told(directory) | Turn::Passed { directory, .. } => directory.to_str().unwrap(),
        });
        assert_eq!(names.collect::<Vec<_>>(), ["r", "a", "s", "b"]);
        assert_eq!(due.ended_pass(now + PAUSE), Some(true));
        assert_eq!(due.ended_pass(now + PAUSE), None);
        // Repeated requests do not shorten the pause.
        due.pass_at(now);
        assert_eq!(due.next_pass(), Some(now + PAUSE + PAUSE * SHARE));
    }
}
