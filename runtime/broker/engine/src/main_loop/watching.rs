//! Watcher of the loop, and its replacement when it waits for a file that does not respond.
//!
//! A thread that waits for a disk in vain cannot be ended, but another one can take over its work. The I/O watchdog
//! keeps the new thread away from that disk. Messages of the old thread are ignored if it ever returns.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use qcbus_types::Notice;
use qcbus_watch::{Known, Seen, WatchOptions, Watcher};
use tokio::sync::mpsc::UnboundedSender;

use super::Broker;

/// First number of watchers at the I/O watchdog. Numbers of jobs and probes never reach it.
const FIRST: u64 = 3 << 62;

/// The current watcher and the channel for its messages.
pub(super) struct Watching {
    current: Arc<AtomicU64>,
    seen: UnboundedSender<Seen>,
    /// The current watcher waits in vain, and no replacement could be started yet.
    is_alone: bool,
}

impl Watching {
    pub(super) fn new(seen: UnboundedSender<Seen>) -> Watching {
        let current = Arc::new(AtomicU64::new(FIRST - 1));
        Watching {
            current,
            seen,
            is_alone: false,
        }
    }

    /// Checks whether no thread currently watches for changes.
    fn is_alone(&self) -> bool {
        self.is_alone
    }

    fn number(&self) -> u64 {
        self.current.load(Ordering::Acquire)
    }
}

impl Broker {
    /// Starts a watcher. `known` is the state that it continues with.
    pub(super) fn watch(
        &self,
        watching: &Watching,
        known: Option<Known>,
    ) -> std::io::Result<Watcher> {
        let options = WatchOptions {
            roots: self.options.roots.clone(),
            poll: self.options.poll,
            rescan: self.options.rescan,
            settle: self.options.settle,
        };
        let own = watching.number() + 1;
        let (current, seen) = (watching.current.clone(), watching.seen.clone());
        let tell = move |what| {
            if current.load(Ordering::Acquire) == own {
                // The error is ignored: after the end of the loop the message is not needed.
                let _ = seen.send(what);
            }
        };
        watching.current.store(own, Ordering::Release);
        let started = Watcher::start(options, (self.looks.io_watchdog(), own), known, tell);
        if started.is_err() {
            watching.current.store(own - 1, Ordering::Release);
        }
        started
    }

    /// Checks whether this is the number of a watcher. If it is the current watcher, it waits in
    /// vain and is replaced.
    pub(super) fn is_watcher(&mut self, number: u64) -> bool {
        let is_current = |it: &mut Watching| it.number() == number;
        if let Some(mut watching) = self.watching.take_if(is_current) {
            self.succeed(&mut watching);
            self.watching = Some(watching);
        }
        number >= FIRST
    }

    pub(super) fn is_nobody_watching(&self) -> bool {
        self.watching.as_ref().is_some_and(Watching::is_alone)
    }

    /// Tries again to start a replacement after no thread could be started.
    pub(super) fn watch_again(&mut self) {
        if let Some(mut watching) = self.watching.take_if(|it| it.is_alone) {
            self.succeed(&mut watching);
            self.watching = Some(watching);
        }
    }

    fn succeed(&mut self, watching: &mut Watching) {
        let known = self.state.has_looked().then(|| Known {
            files: self.state.present_files(),
        });
        match self.watch(watching, known) {
            Ok(watcher) => {
                // Paths that still cannot be read are reported again.
                self.unseen.retain(|path, _| self.looks.is_hanging(path));
                self.unfinished.clear();
                watcher.depend(self.state.dependencies());
                self.watcher = Some(watcher);
                watching.is_alone = false;
            }
            Err(_) if watching.is_alone => {}
            Err(error) => {
                watching.is_alone = true;
                self.say(Notice::Watching(format!(
                    "changes are not watched at the moment: {error}; this is retried"
                )));
            }
        }
    }

    /// Handles a path that responds again. It may have changed meanwhile.
    pub(super) fn answers_again(&mut self, path: PathBuf) {
        self.unseen.remove(&path);
        if let Some(watcher) = &self.watcher {
            watcher.look(path.into());
        }
    }
}
