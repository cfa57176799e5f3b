//! Events from the kernel, and what is done where they cannot be had.

use std::path::{Path, PathBuf};
use std::time::Duration;

use notify::event::{
    AccessKind, AccessMode, CreateKind, EventKind, ModifyKind, RemoveKind, RenameMode,
};
use notify::{Config, RecursiveMode, Watcher as _};
use qcbus_document::FileKind;

use super::ignore::{IGNORE_FILE, is_ignored_file};
use super::looker::Looker;
use super::sight::{Sight, look_at};
use super::{Order, Seen};
use crate::seams::{FileEvents, Sender, now};
use crate::stamp::stamp_of;

impl Looker {
    /// Asks the kernel for events; where it refuses, says so and looks around instead.
    pub(super) fn watch(&mut self, events: &Sender<Order>) {
        if let Some(every) = self.options.poll {
            (self.tell)(Seen::Mode(format!(
                "poll every {} s, as asked",
                every.as_secs_f64()
            )));
            return;
        }
        let events = events.clone();
        let tell = move |event| {
            // After the end nobody listens any more.
            let _ = events.send(Order::Event(event));
        };
        // Through a link to it a directory would have its events told under the link's path alone.
        let config = Config::default().with_follow_symlinks(false);
        let watcher = FileEvents::new(tell, config);
        let mut watcher = match watcher {
            Ok(watcher) => watcher,
            Err(error) => return self.fall_back(&error.to_string()),
        };
        for root in self.options.roots.clone() {
            if let Err(error) = watcher.watch(&root, RecursiveMode::Recursive) {
                if root.is_dir() {
                    return self.fall_back(&format!("{}: {error}", root.display()));
                }
                self.lose_root(&root);
            }
        }
        self.watcher = Some(watcher);
        (self.tell)(Seen::Mode("events".to_owned()));
    }

    fn fall_back(&mut self, why: &str) {
        let every = Duration::from_secs(2);
        self.polling = Some(every);
        self.watcher = None;
        self.dependencies.poll_all();
        (self.tell)(Seen::Mode(format!(
            "poll every 2 s, because events cannot be had: {why}"
        )));
        (self.tell)(Seen::Notice(format!(
            "cannot watch by events ({why}); looking around every 2 s instead. \
             On Linux, `sysctl fs.inotify.max_user_watches` is the usual limit."
        )));
    }

    pub(super) fn lose_root(&mut self, root: &Path) {
        if self.lost_roots.insert(root.to_path_buf()) {
            self.dependencies.poll_all();
            (self.tell)(Seen::Notice(format!(
                "the watched directory {} is gone; its results are kept, and it is watched again \
                 when it comes back",
                root.display()
            )));
        }
    }

    pub(super) fn recover_roots(&mut self, events: &Sender<Order>) {
        let back: Vec<PathBuf> = self
            .lost_roots
            .iter()
            .filter(|root| root.is_dir())
            .cloned()
            .collect();
        if back.is_empty() {
            return;
        }
        for root in back {
            self.lost_roots.remove(&root);
            self.tell_again_below(&root);
            (self.tell)(Seen::Notice(format!(
                "the watched directory {} is back",
                root.display()
            )));
        }
        if self.options.poll.is_none() {
            self.watcher = None;
            self.watch(events);
        }
    }

    pub(super) fn event(&mut self, event: notify::Result<notify::Event>) {
        let event = match event {
            Ok(event) => event,
            Err(error) => {
                if matches!(error.kind, notify::ErrorKind::MaxFilesWatch) {
                    self.fall_back(&error.to_string());
                } else {
                    (self.tell)(Seen::Notice(format!("watching: {error}")));
                }
                return;
            }
        };
        if event.need_rescan() {
            (self.tell)(Seen::Notice(
                "the kernel dropped file events; everything is looked through again".to_owned(),
            ));
            self.scan_all(false);
            self.dependencies.poll_all();
            self.look_at_dependencies();
            return;
        }
        for path in &event.paths {
            self.path_event(event.kind, path);
        }
    }

    fn path_event(&mut self, kind: EventKind, path: &Path) {
        if is_only_reading(kind) {
            return;
        }
        if path.file_name().is_some_and(|name| name == IGNORE_FILE) {
            return self.scan_all(false);
        }
        if self.options.roots.iter().any(|root| root == path) {
            if matches!(
                kind,
                EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_))
            ) && !path.is_dir()
            {
                self.lose_root(path);
            }
            return;
        }
        match kind {
            EventKind::Access(AccessKind::Close(AccessMode::Write))
            | EventKind::Modify(ModifyKind::Name(
                RenameMode::To | RenameMode::Both | RenameMode::Any,
            )) => {
                self.finished(path);
            }
            EventKind::Create(CreateKind::Folder) => self.scan_below(path),
            EventKind::Remove(RemoveKind::Folder) => self.gone_below(path),
            EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(RenameMode::From)) => {
                self.finished(path);
            }
            EventKind::Create(_) | EventKind::Modify(_) | EventKind::Any | EventKind::Other => {
                self.touched(path);
            }
            EventKind::Access(_) => {}
        }
    }

    /// Closed, renamed or removed: look at once.
    fn finished(&mut self, path: &Path) {
        self.settling.done(path);
        if path.is_dir() && !path.is_symlink() {
            return self.scan_below(path);
        }
        if self.known.contains_key(path) || self.cares_about(path) {
            self.look(path);
        } else if FileKind::of_path(path).is_none() && !path.exists() {
            self.gone_below(path);
        }
        self.look_for_a_link(path);
    }

    fn touched(&mut self, path: &Path) {
        if self.cares_about(path) {
            self.settling
                .touched(path, stamp_of(path).ok().flatten(), now());
        }
        self.look_for_a_link(path);
    }

    /// Whether a link came that hides a directory; one to a file is looked at as that file.
    fn look_for_a_link(&mut self, path: &Path) {
        if !path.is_symlink() || self.ignored(path, true) {
            return;
        }
        match look_at(path, &self.options.roots) {
            Sight::NoFile(what) if what.hides_more() => self.unseen(path, what.to_string()),
            _ => {}
        }
    }

    fn cares_about(&mut self, path: &Path) -> bool {
        let checkable =
            FileKind::of_path(path).is_some() && !path.file_name().is_some_and(is_ignored_file);
        self.dependencies.contains(path) || (checkable && !self.ignored(path, false))
    }
}

/// Whether somebody has only looked at the file, as the watcher itself does with a `.qcignore`.
fn is_only_reading(kind: EventKind) -> bool {
    matches!(kind, EventKind::Access(access) if access != AccessKind::Close(AccessMode::Write))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_a_file_is_no_change_of_it() {
        use AccessKind::{Close, Open, Read};
        for access in [
            Read,
            Open(AccessMode::Any),
            Open(AccessMode::Write),
            Close(AccessMode::Read),
        ] {
            assert!(is_only_reading(EventKind::Access(access)), "{access:?}");
        }
        assert!(!is_only_reading(EventKind::Access(Close(
            AccessMode::Write
        ))));
        assert!(!is_only_reading(EventKind::Create(CreateKind::File)));
    }
}
