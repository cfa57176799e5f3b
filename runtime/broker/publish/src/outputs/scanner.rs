//! The thread that scans outputs: after kernel events, and periodically.

use std::ops::Bound;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use qcbus_environment::{FileEvent, now};
use qcbus_types::LostOutput;
use qcbus_watch::{Tree, Unwatched, below};
use rustix::fs::inotify::ReadFlags;

use super::{Shared, TellLost, Written};

/// Interval of the periodic scan of some outputs.
const INTERVAL: Duration = Duration::from_secs(1);

/// Number of intervals in which every output is scanned once.
const TURNS: usize = 30;

/// Scanner thread for the outputs.
pub(super) struct Scanner {
    shared: Arc<Shared>,
    tell: TellLost,
    tree: Tree,
    /// Last output of the periodic scan.
    last: Option<Arc<Path>>,
    lost: Vec<LostOutput>,
}

impl Scanner {
    pub(super) fn new(shared: Arc<Shared>, tell: TellLost) -> Scanner {
        let mut tree = Tree::default();
        if let Err(error) = tree.open() {
            let seconds = TURNS as u64 * INTERVAL.as_secs();
            tracing::warn!(
                "changes of results are detected within {seconds} s instead of immediately, because the kernel \
                 provides no events: {error}"
            );
        }
        Scanner {
            shared,
            tell,
            tree,
            last: None,
            lost: Vec::new(),
        }
    }

    pub(super) fn run(mut self) {
        let mut next_turn = now() + INTERVAL;
        while !self.shared.is_over.load(Ordering::Acquire) {
            self.watch_fresh();
            self.take_events();
            if now() >= next_turn {
                self.turn();
                next_turn = now() + INTERVAL;
            }
            if !self.lost.is_empty() {
                (self.tell)(std::mem::take(&mut self.lost));
            }
            self.wait(next_turn);
        }
    }

    fn wait(&self, until: Instant) {
        let rest = until.saturating_duration_since(now());
        self.shared.bell.wait(self.tree.kernel(), rest);
    }

    /// Watches directories that received their first output, and then scans their outputs. An
    /// output may have been lost before.
    fn watch_fresh(&mut self) {
        let fresh = std::mem::take(&mut self.shared.book().fresh);
        for directory in fresh {
            match self.tree.watch(&directory) {
                // The periodic scan still covers the outputs in it.
                Ok(()) | Err(Unwatched::NoneLeft | Unwatched::Closed | Unwatched::Refused(_)) => {}
                Err(Unwatched::Gone) => self.let_go(&directory),
            }
            self.look_below(&directory);
        }
    }

    /// Stops watching a directory. The next output in it starts a new watch.
    fn let_go(&mut self, directory: &Path) {
        self.tree.remove_below(directory);
        let mut book = self.shared.book();
        book.directories.retain(|it| !it.starts_with(directory));
    }

    fn take_events(&mut self) {
        let events = match self.tree.events() {
            Ok(events) => events,
            Err(error) => {
                tracing::warn!("cannot read the kernel's events about results: {error}");
                Vec::new()
            }
        };
        for told in events {
            if told.what.contains(ReadFlags::QUEUE_OVERFLOW) {
                self.look_at_all();
            }
            for directory in self.tree.places(&told) {
                self.event(&directory, &told);
            }
        }
    }

    fn event(&mut self, directory: &Path, told: &FileEvent) {
        let itself =
            ReadFlags::DELETE_SELF | ReadFlags::MOVE_SELF | ReadFlags::UNMOUNT | ReadFlags::IGNORED;
        match &told.name {
            Some(name) if told.what.contains(ReadFlags::ISDIR) => {
                let path = directory.join(name);
                let went = ReadFlags::DELETE | ReadFlags::MOVED_FROM;
                if told.what.intersects(went) {
                    self.let_go(&path);
                }
                self.look_below(&path);
            }
            Some(name) => self.look(&directory.join(name)),
            None if told.what.intersects(itself) => {
                self.let_go(directory);
                self.look_below(directory);
            }
            None => {}
        }
    }

    fn look(&mut self, output: &Path) {
        let is_new = |it: &mut Written| !std::mem::replace(&mut it.is_told, true);
        let lost = self.shared.look(output, is_new);
        self.lost.extend(lost);
    }

    fn look_below(&mut self, directory: &Path) {
        let outputs: Vec<Arc<Path>> = {
            let book = self.shared.book();
            let below = below(&book.written, directory);
            below.map(|(path, _)| path.clone()).collect()
        };
        for output in outputs {
            self.look(&output);
        }
    }

    /// Scans all outputs after events were lost.
    fn look_at_all(&mut self) {
        let all: Vec<Arc<Path>> = self.shared.book().written.keys().cloned().collect();
        for output in all {
            self.look(&output);
        }
    }

    /// Scans the next outputs of the periodic scan, and retries failed removals.
    fn turn(&mut self) {
        qcbus_disk::remove_left();
        let due: Vec<Arc<Path>> = {
            let book = self.shared.book();
            let begin = self.last.take().map_or(Bound::Unbounded, Bound::Excluded);
            let rest = book
                .written
                .range::<Arc<Path>, _>((begin, Bound::Unbounded));
            let due = book.written.len().div_ceil(TURNS);
            rest.take(due).map(|(path, _)| path.clone()).collect()
        };
        self.last = due.last().cloned();
        for output in due {
            self.look(&output);
        }
    }
}
