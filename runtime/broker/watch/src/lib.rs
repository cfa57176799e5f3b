//! Watches directories with kernel events where available, and by scanning at intervals elsewhere. Both have the same
//! result.
//!
//! One thread scans and reads the events itself. Pending events stay in the kernel, up to its limit, and not in the
//! broker. Every directory is watched separately and scanned immediately afterwards. Therefore a new directory is
//! seen completely, and a failed watch affects only that directory. Symbolic links to directories are never followed.

mod dependencies;
mod due;
mod events;
mod file_lookup;
mod ignore;
mod open_files;
pub mod probes;
mod rest;
mod roots;
mod scan;
mod scanner;
mod settle;
pub mod stamp;
#[cfg(test)]
mod tests;
mod through;
mod tree;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_disk::foreign::IoWatchdog;
use qcbus_document::FileKind;
use qcbus_environment::{Bell, Sender, channel, thread};
use qcbus_messages::control::Unseen;
use qcbus_types::Stamp;

use self::ignore::IgnoreRules;
use self::scan::scan;
use self::scanner::Scanner;

pub use self::file_lookup::{FileLookup, NoFile, is_behind_a_link, look_at};
pub use self::ignore::{hidden_above, is_excluded};
pub use self::scan::Scan;
pub use self::settle::{OPEN_QUIET, Why};
pub use self::tree::{Tree, Unwatched, below};

/// Returns every checkable file below a directory, once. `roots` are all scanned directories, without symbolic links.
pub fn scan_directory(directory: &Path, roots: &[PathBuf]) -> Scan {
    scan(directory, roots, &mut IgnoreRules::new(directory))
}

/// Checks whether a file below one of the roots is ignored because of its name or a `.qcignore`.
pub fn is_left_alone(roots: &[PathBuf], file: &Path) -> bool {
    let inside = roots.iter().filter(|root| file.starts_with(root));
    let mut ignored = inside
        .map(|root| IgnoreRules::new(root).ignores(file, false))
        .peekable();
    ignored.peek().is_some() && ignored.all(|it| it)
}

/// Checks whether a scan of the roots finds a file: it has a checkable kind, is not ignored, and is
/// not behind a link to a directory.
pub fn is_looked_at(roots: &[PathBuf], file: &Path) -> bool {
    FileKind::of_path(file).is_some()
        && roots.iter().any(|root| file.starts_with(root))
        && !is_behind_a_link(file, roots)
        && !is_left_alone(roots, file)
}

/// Report of the watcher.
#[derive(Debug)]
pub enum Seen {
    /// A file exists and has settled.
    Settled(Arc<Path>, Stamp),
    /// A file existed in the first scan, and may still be written to.
    Present(Arc<Path>),
    /// A file is being written to, with its current stamp. It is judged when it has settled.
    Unfinished(Arc<Path>, Option<Stamp>, Why),
    /// A dependency of a verdict has changed. It need not be a checkable file.
    Touched(Arc<Path>, Stamp),
    /// A file was removed.
    Vanished(Arc<Path>),
    /// A path is inaccessible. This is reported once until the path is accessible again.
    Unseen(Unseen),
    /// A watched directory is missing. A notice reports this.
    Away(Unseen),
    /// A path is accessible again, or was removed.
    SeenAgain(PathBuf),
    /// The first full scan is complete.
    Scanned,
    /// Mode of detecting changes, for `status`.
    Mode(String),
    /// A message for the user.
    Notice(String),
}

/// Options of a watcher.
#[derive(Debug, Clone)]
pub struct WatchOptions {
    /// Directories, absolute and without symbolic links.
    pub roots: Vec<PathBuf>,
    /// Interval of scans that replace events.
    pub poll: Option<Duration>,
    /// Interval of scans in addition to events, because kernels and file systems lose some events.
    pub rescan: Duration,
    /// Time without changes that a file written in place must have, even after it is closed.
    pub settle: Option<Duration>,
}

/// State that a watcher takes over from an earlier one. The first full scan is already complete then.
#[derive(Debug)]
pub struct Known {
    /// Files that existed.
    pub files: Vec<Arc<Path>>,
}

/// A running watcher. It stops when this value is dropped.
#[derive(Debug)]
pub struct Watcher {
    orders: Sender<Order>,
    /// Wakes the thread that waits for events.
    bell: Arc<Bell>,
}

enum Order {
    Depend(Vec<(Arc<Path>, Option<Stamp>)>),
    Undepend(Vec<Arc<Path>>),
    Forget(Arc<Path>),
    Learn(Arc<Path>, Stamp),
    Look(Arc<Path>),
    Stop,
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.order(Order::Stop);
    }
}

impl Watcher {
    /// Starts watching on a separate thread, which calls `tell`. The I/O watchdog monitors the
    /// thread under the given number. With `known`, the watcher continues the work of an earlier
    /// one.
    ///
    /// # Errors
    /// When no thread can be started, or when no file descriptor for waking it is available.
    pub fn start(
        options: WatchOptions,
        (io_watchdog, number): (Arc<IoWatchdog>, u64),
        known: Option<Known>,
        tell: impl FnMut(Seen) + Send + 'static,
    ) -> std::io::Result<Watcher> {
        let (orders, inbox) = channel();
        let bell = Arc::new(Bell::new()?);
        let mut scanner = Scanner::new(options, Box::new(tell));
        if let Some(known) = known {
            scanner.go_on_with(known);
        }
        let rung = bell.clone();
        thread::Builder::new()
            .name("watch".to_owned())
            .spawn(move || {
                let _attendance = io_watchdog.attend(number);
                scanner.run(&inbox, &rung);
            })?;
        Ok(Watcher { orders, bell })
    }

    fn order(&self, order: Order) {
        // The thread ends only after this value is dropped, so the receiver exists.
        let _ = self.orders.send(order);
        self.bell.ring();
    }

    /// Monitors dependencies of verdicts, wherever they are. A change since the given stamp is
    /// reported like any other.
    pub fn depend(&self, files: Vec<(Arc<Path>, Option<Stamp>)>) {
        self.order(Order::Depend(files));
    }

    /// Removes a file that the broker found missing. If it exists again, this is reported.
    pub fn forget(&self, path: Arc<Path>) {
        self.order(Order::Forget(path));
    }

    /// Registers a file that the broker learned about from another source. Its removal is then reported.
    pub fn learn(&self, path: Arc<Path>, stamp: Stamp) {
        self.order(Order::Learn(path, stamp));
    }

    /// Scans a file that was requested without an earlier report. Its state or removal is reported
    /// once it has settled.
    pub fn look(&self, path: Arc<Path>) {
        self.order(Order::Look(path));
    }

    /// Stops monitoring files that no verdict depends on any more.
    pub fn undepend(&self, paths: Vec<Arc<Path>>) {
        self.order(Order::Undepend(paths));
    }
}
