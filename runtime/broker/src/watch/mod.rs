//! Watching directories: events from the kernel where they can be had, looking around at
//! intervals where they cannot, and both with the same outcome.
//!
//! One thread looks, and takes the events itself: the kernel keeps those that wait, as many as it
//! likes, and not the broker. Every directory is watched by itself and looked through right after, so
//! that one that has just come is seen as a whole, and one that cannot be watched costs itself.
//! Symbolic links to directories are never followed.

mod dependencies;
mod due;
mod events;
mod file_lookup;
mod ignore;
pub mod kernel;
mod open_files;
mod rest;
mod roots;
mod scan;
mod scanner;
mod settle;
#[cfg(test)]
mod tests;
mod through;
mod tree;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_disk::foreign::IoWatchdog;
use qcbus_document::FileKind;
use qcbus_messages::control::Unseen;

use self::ignore::IgnoreRules;
use self::scan::scan;
use self::scanner::Scanner;
use crate::core::Stamp;
use crate::environment::{Bell, Sender, channel, thread};

pub use self::file_lookup::{FileLookup, NoFile, is_behind_a_link, look_at};
pub use self::ignore::{hidden_above, is_excluded};
pub use self::scan::Scan;
#[cfg(test)]
pub(crate) use self::settle::OPEN_QUIET;
pub use self::settle::Why;
pub(crate) use self::tree::{Told, Tree, Unwatched, below};

/// Every checkable file below a directory, once. `roots` are all the directories that are looked
/// at, without symbolic links.
pub fn scan_directory(directory: &Path, roots: &[PathBuf]) -> Scan {
    scan(directory, roots, &mut IgnoreRules::new(directory))
}

/// Whether a file below one of the roots is ignored, by its name or a `.qcignore`.
pub fn is_left_alone(roots: &[PathBuf], file: &Path) -> bool {
    let inside = roots.iter().filter(|root| file.starts_with(root));
    let mut ignored = inside
        .map(|root| IgnoreRules::new(root).ignores(file, false))
        .peekable();
    ignored.peek().is_some() && ignored.all(|it| it)
}

/// Whether a file is one that a look through the roots finds: of a kind that is checked, not
/// ignored, and not behind a link to a directory.
pub fn is_looked_at(roots: &[PathBuf], file: &Path) -> bool {
    FileKind::of_path(file).is_some()
        && roots.iter().any(|root| file.starts_with(root))
        && !is_behind_a_link(file, roots)
        && !is_left_alone(roots, file)
}

/// What the watcher has to say.
#[derive(Debug)]
pub enum Seen {
    /// A file is there and quiet.
    Settled(Arc<Path>, Stamp),
    /// A file was there in the first scan, and may still be written to.
    Present(Arc<Path>),
    /// A file is being written to, as it is now, and is not judged until it has settled.
    Unfinished(Arc<Path>, Option<Stamp>, Why),
    /// Something that a verdict depends on has become another. It need not be a file to check.
    Touched(Arc<Path>, Stamp),
    /// A file has gone.
    Vanished(Arc<Path>),
    /// Something cannot be looked at; said once, until it can.
    Unseen(Unseen),
    /// A watched directory is away, which is said by a notice.
    Away(Unseen),
    /// What could not be looked at can be, or has gone.
    SeenAgain(PathBuf),
    /// The first scan of everything is complete.
    Scanned,
    /// How changes are noticed, for `status`.
    Mode(String),
    /// Something for a person.
    Notice(String),
}

/// How to watch.
#[derive(Debug, Clone)]
pub struct WatchOptions {
    /// Directories, absolute and without symbolic links.
    pub roots: Vec<PathBuf>,
    /// Look around this often instead of relying on events.
    pub poll: Option<Duration>,
    /// Look around this often even when events arrive, because kernels and file systems lose some.
    pub rescan: Duration,
    /// How long files must be quiet that are written in place, also once they are closed.
    pub settle: Option<Duration>,
}

/// What a watcher goes on with that takes the place of another. The first look through everything is over then.
#[derive(Debug)]
pub struct Known {
    /// The files that were there.
    pub files: Vec<Arc<Path>>,
}

/// A running watcher. It stops when this is dropped.
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
    /// Starts watching on a thread of its own; `tell` is called from there, and the lookout sees under that number
    /// where it waits. `known`: it takes the place of another.
    ///
    /// # Errors
    /// When no thread can be started, or there is no descriptor left to wake it.
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
        // The thread only ends when this is dropped.
        let _ = self.orders.send(order);
        self.bell.ring();
    }

    /// Keeps an eye on files on which verdicts depend, wherever they are.
    /// A change since the given stamp is told like any other.
    pub fn depend(&self, files: Vec<(Arc<Path>, Option<Stamp>)>) {
        self.order(Order::Depend(files));
    }

    /// The broker has let go of a file that it found gone. Should it be there again, that is told.
    pub fn forget(&self, path: Arc<Path>) {
        self.order(Order::Forget(path));
    }

    /// The broker has heard of a file from somebody else: when it goes, that is told.
    pub fn learn(&self, path: Arc<Path>, stamp: Stamp) {
        self.order(Order::Learn(path, stamp));
    }

    /// Somebody asks for a file of which nothing was told: what is there now, or has gone, is told once it is at rest.
    pub fn look(&self, path: Arc<Path>) {
        self.order(Order::Look(path));
    }

    /// Lets go of files on which no verdict depends any more.
    pub fn undepend(&self, paths: Vec<Arc<Path>>) {
        self.order(Order::Undepend(paths));
    }
}
