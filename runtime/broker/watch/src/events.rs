//! Kernel events, and polling where events are not available.

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use qcbus_disk::foreign;
use qcbus_document::FileKind;
use qcbus_environment::{FileEvent, now};
use rustix::fs::inotify::ReadFlags;

use super::Seen;
use super::file_lookup::{FileLookup, look_at};
use super::ignore::{IGNORE_FILE, is_ignored_file, passes_over};
use super::scanner::Scanner;
use super::tree::Unwatched;
use crate::stamp::stamp_of;

/// Interval of scans of directories without events.
const EVERY: Duration = Duration::from_secs(2);

/// Additional time for each directory, so that a large number of them does not use all the time.
const FOR_EACH: Duration = Duration::from_micros(100);

/// Minimum interval of the notice about lost events.
const SAY_AGAIN: Duration = Duration::from_secs(60);

/// State of the polling of directories without events.
#[derive(Debug, Default)]
pub struct Polling {
    /// Reason why no events are available at all.
    without: Option<String>,
    /// Whether the kernel refused a watch. The next full scan tries again.
    none_left: bool,
    /// Whether the notice about this was sent.
    is_said: bool,
    /// Time of the last scan of directories without a watch.
    last: Option<Instant>,
    /// Time of the last notice about lost events.
    lost_events: Option<Instant>,
    /// Last reported mode of detecting changes.
    mode: String,
}

impl Scanner {
    /// Opens the kernel's event queue. If this fails, sends a notice and polls instead.
    pub(super) fn ask_for_events(&mut self) {
        if self.options.poll.is_none() && !self.tree.is_open() {
            match self.tree.open() {
                Ok(()) => self.polling.without = None,
                Err(error) => self.do_without_events(&error),
            }
        }
        self.tell_mode();
    }

    fn do_without_events(&mut self, error: &io::Error) {
        let first = self.polling.without.is_none();
        self.polling.without = Some(error.to_string());
        self.dependencies.poll_all();
        if first {
            (self.tell)(Seen::Notice(format!(
                "cannot watch by events ({error}); scanning every {} s instead. The usual limits are `sysctl \
                 fs.inotify.max_user_instances` and `ulimit -n`; events are used again once there is room.",
                EVERY.as_secs()
            )));
        }
    }

    /// Returns the interval of full scans.
    pub(super) fn pass_interval(&self) -> Duration {
        let without = self.polling.without.is_some().then_some(EVERY);
        let interval = self.options.poll.or(without);
        interval.unwrap_or(self.options.rescan).min(A_YEAR)
    }

    /// Tries failed watches again at the start of a full scan.
    pub(super) fn begin_to_watch_again(&mut self) {
        self.polling.none_left = false;
        if self.polling.without.is_some() {
            self.ask_for_events();
        }
    }

    /// Watches a directory, or registers it as one without events.
    pub(super) fn watch_directory(&mut self, directory: &Path) -> Result<(), Unwatched> {
        if !self.tree.is_open() || (self.polling.none_left && !self.tree.tells_of(directory)) {
            self.tree.keep_unwatched(directory);
            return Ok(());
        }
        let watched = self.tree.watch(directory);
        match &watched {
            Ok(()) | Err(Unwatched::Gone) => {}
            Err(Unwatched::NoneLeft) => {
                self.polling.none_left = true;
                self.tree.keep_unwatched(directory);
                self.say_that_none_are_left();
            }
            // The scan reports an unreadable directory. A root must be registered nevertheless.
            Err(Unwatched::Closed) => {
                if self.options.roots.iter().any(|root| root == directory) {
                    self.tree.keep_unwatched(directory);
                }
            }
            Err(Unwatched::Refused(error)) => {
                tracing::debug!(path = %directory.display(), %error, "no watch");
                self.tree.keep_unwatched(directory);
            }
        }
        watched
    }

    fn say_that_none_are_left(&mut self) {
        if std::mem::replace(&mut self.polling.is_said, true) {
            return;
        }
        let limit = std::fs::read_to_string("/proc/sys/fs/inotify/max_user_watches");
        let limit = limit.map_or_else(|_| String::new(), |it| format!(", now {}", it.trim()));
        (self.tell)(Seen::Notice(format!(
            "the kernel has no more watches for this user (`sysctl fs.inotify.max_user_watches`{limit}): further \
             directories are scanned every {} s or less often, the others are watched as before. Raise the \
             limit; it is then retried automatically.",
            EVERY.as_secs()
        )));
    }

    /// Scans the directories without events.
    pub(super) fn poll_what_is_not_watched(&mut self) {
        self.tell_mode();
        let (_, without) = self.tree.counts();
        if !self.tree.is_open() || without == 0 {
            return;
        }
        let every = EVERY + FOR_EACH * u32::try_from(without).unwrap_or(u32::MAX);
        if self.polling.last.is_some_and(|last| since(last) < every) {
            return;
        }
        self.polling.last = Some(now());
        for directory in self.tree.unwatched() {
            self.due.push(&directory);
        }
    }

    fn tell_mode(&mut self) {
        let (_, without) = self.tree.counts();
        let mode = match (self.options.poll, &self.polling.without) {
            (Some(every), _) => format!("poll every {} s, as requested", every.as_secs_f64()),
            (None, Some(why)) => format!(
                "poll every {} s, because events are not available: {why}",
                EVERY.as_secs()
            ),
            (None, None) if without == 0 => "events".to_owned(),
            (None, None) => format!(
                "events; {without} directories that cannot be watched are scanned every {} s or less often",
                EVERY.as_secs()
            ),
        };
        if mode != self.polling.mode {
            self.polling.mode.clone_from(&mode);
            (self.tell)(Seen::Mode(mode));
        }
    }

    /// Reads the pending kernel events, at most a few hundred.
    pub(super) fn take_events(&mut self) {
        let events = match self.tree.events() {
            Ok(events) => events,
            Err(error) => {
                tracing::warn!(%error, "cannot read events");
                return self.have_lost_events();
            }
        };
        for told in events {
            if told.what.contains(ReadFlags::QUEUE_OVERFLOW) {
                self.have_lost_events();
            }
            for directory in self.tree.places(&told) {
                self.event(&directory, &told);
            }
        }
    }

    fn have_lost_events(&mut self) {
        let last = self.polling.lost_events;
        if last.is_none_or(|last| since(last) >= SAY_AGAIN) {
            self.polling.lost_events = Some(now());
            (self.tell)(Seen::Notice(
                "the kernel dropped file events; everything is scanned again".to_owned(),
            ));
        }
        self.dependencies.poll_all();
        self.settling.events_were_lost(now());
        self.due.pass_at(now());
    }

    fn event(&mut self, directory: &Path, told: &FileEvent) {
        let is_root = |path: &Path| self.options.roots.iter().any(|root| root == path);
        let Some(name) = &told.name else {
            return self.event_of_itself(directory, told.what);
        };
        let path = directory.join(name);
        if name == IGNORE_FILE {
            self.due.pass_at(now());
        } else if is_root(&path) {
            self.check_roots();
        } else if told.what.contains(ReadFlags::ISDIR) {
            self.directory_event(&path, told.what);
        } else if told
            .what
            .intersects(ReadFlags::MOVED_TO | ReadFlags::MOVED_FROM | ReadFlags::DELETE)
        {
            self.finished(&path);
        } else if told.what.contains(ReadFlags::CLOSE_WRITE) {
            self.closed(&path);
        } else {
            self.touched(&path, told.what);
        }
    }

    /// Handles an event of a directory itself. A watched parent already reports the change.
    fn event_of_itself(&mut self, directory: &Path, what: ReadFlags) {
        if self.options.roots.iter().any(|root| root == directory) {
            self.check_roots();
        } else if what.intersects(ReadFlags::UNMOUNT | ReadFlags::IGNORED) {
            self.due.push(directory);
        }
    }

    fn directory_event(&mut self, path: &Path, what: ReadFlags) {
        if passes_over(&mut self.rules, path) {
            return;
        }
        if what.intersects(ReadFlags::CREATE | ReadFlags::MOVED_TO) {
            // Another directory may have been at this path before.
            self.tree.remove_below(path);
            self.forget_rules_below(path);
            self.due.push(path);
        } else if what.intersects(ReadFlags::DELETE | ReadFlags::MOVED_FROM) {
            self.gone(path);
        } else if !self.tree.tells_of(path) {
            // The directory may be readable now.
            self.due.push(path);
        }
    }

    /// Scans a file immediately after it was renamed, removed or closed.
    fn finished(&mut self, path: &Path) {
        self.settling.done(path);
        if self.known.contains_key(path) || self.cares_about(path) {
            self.look(path);
        }
        self.look_for_a_link(path);
    }

    fn closed(&mut self, path: &Path) {
        let stamp = stamp_of(path).ok().flatten();
        if !self.cares_about(path) || !self.settling.closed(path, stamp, now()) {
            self.finished(path);
        }
    }

    fn touched(&mut self, path: &Path, what: ReadFlags) {
        if self.cares_about(path) {
            let stamp = stamp_of(path).ok().flatten();
            // A new hard link for a file also creates an event. Only an empty file will certainly be written.
            let is_empty = stamp.is_some_and(|it| it.size == 0);
            if what.contains(ReadFlags::MODIFY) || (what.contains(ReadFlags::CREATE) && is_empty) {
                self.settling.written(path, stamp, now());
            } else {
                self.settling.touched(path, stamp, now());
            }
        }
        self.look_for_a_link(path);
    }

    /// Checks whether a link has appeared or disappeared that hides a directory. A link with the
    /// name of a checkable file is scanned as that file.
    fn look_for_a_link(&mut self, path: &Path) {
        if !foreign::is_symlink(path).unwrap_or(false) {
            if self.unseen.contains_key(path) {
                self.look(path);
            }
            return;
        }
        if self.ignored(path, false) || self.ignored(path, true) {
            return;
        }
        match look_at(path, &self.options.roots) {
            FileLookup::NoFile(what) if what.hides_more() => self.unseen(path, what.to_string()),
            _ if FileKind::of_path(path).is_none() => self.seen_again(path),
            _ => {}
        }
    }

    pub(super) fn cares_about(&mut self, path: &Path) -> bool {
        let checkable =
            FileKind::of_path(path).is_some() && !path.file_name().is_some_and(is_ignored_file);
        self.dependencies.contains(path) || (checkable && !self.ignored(path, false))
    }
}

fn since(moment: Instant) -> Duration {
    now().saturating_duration_since(moment)
}

/// Upper limit for intervals: longer than any run, but small enough to be added to any time.
const A_YEAR: Duration = Duration::from_secs(365 * 86_400);
