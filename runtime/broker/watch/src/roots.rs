//! The watched directories themselves: they may be removed, come back, or be replaced by others.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_messages::control::Unseen;
use qcbus_messages::path_text::to_text;

use super::Seen;
use super::scanner::Scanner;

/// Device and inode of a directory.
type Identity = (u64, u64);

/// State of the watched directories.
#[derive(Debug, Default)]
pub struct Roots {
    /// Missing watched directories.
    lost: BTreeSet<PathBuf>,
    /// Identity of each directory when it last existed.
    seen: BTreeMap<PathBuf, Identity>,
}

impl Roots {
    /// Checks whether a path is in a missing watched directory. Its results are kept until it is back.
    pub fn is_away(&self, path: &Path) -> bool {
        !self.lost.is_empty() && self.lost.iter().any(|root| path.starts_with(root))
    }
}

impl Scanner {
    /// Checks whether each watched directory exists and is the same as before.
    pub fn check_roots(&mut self) {
        for root in self.options.roots.clone() {
            self.check_root(&root);
        }
    }

    fn check_root(&mut self, root: &Path) {
        let now = match look(root) {
            Root::Here(now) => now,
            Root::Away(how) => return self.lose_root(root, &how),
        };
        let before = self.roots.seen.get(root).copied();
        if before.is_some_and(|before| is_unmounted(root, before, now)) {
            return self.lose_root(
                root,
                "is empty and on a different file system than before, as after an unmount",
            );
        }
        let was_lost = self.roots.lost.remove(root);
        if was_lost {
            (self.tell)(Seen::SeenAgain(root.to_path_buf()));
        }
        // A new directory may have the inode number of the previous one, so the watch is checked as well.
        let is_watched = self.tree.contains(root) || self.due.covers(root);
        let what = match before {
            _ if was_lost => "is back",
            Some(before) if before != now || !is_watched => {
                "is a different directory than before, and is scanned again"
            }
            Some(_) => return,
            None => {
                self.roots.seen.insert(root.to_path_buf(), now);
                return;
            }
        };
        self.roots.seen.insert(root.to_path_buf(), now);
        self.tree.remove_below(root);
        self.forget_rules_below(root);
        self.dependencies.poll_all();
        self.tell_again_below(root);
        self.due.push(root);
        self.say_of_root(root, what);
    }

    fn say_of_root(&mut self, root: &Path, what: &str) {
        let root = to_text(root);
        (self.tell)(Seen::Notice(format!("the watched directory {root} {what}")));
    }

    fn lose_root(&mut self, root: &Path, how: &str) {
        if self.roots.lost.insert(root.to_path_buf()) {
            self.tree.remove_below(root);
            self.dependencies.poll_all();
            let (path, why) = (root.to_path_buf(), how.to_owned());
            (self.tell)(Seen::Away(Unseen { path, why }));
            self.say_of_root(
                root,
                &format!("{how}; its results are kept, and it is watched again when it is back"),
            );
        }
    }

    /// Checks whether a path is missing because its watched directory is missing.
    pub fn is_root_gone(&mut self, path: &Path) -> bool {
        let inside = |root: &&PathBuf| path.starts_with(root);
        let roots: Vec<PathBuf> = self.options.roots.iter().filter(inside).cloned().collect();
        for root in roots {
            if let Root::Away(how) = look(&root) {
                self.lose_root(&root, &how);
            }
        }
        self.roots.is_away(path)
    }
}

/// State of the path of a watched directory.
enum Root {
    Here(Identity),
    /// The directory is missing or inaccessible, with the reason.
    Away(String),
}

fn look(root: &Path) -> Root {
    let how = match foreign::symlink_metadata(root) {
        Ok(data) if data.is_dir() => return Root::Here((data.dev(), data.ino())),
        // A link would have been resolved at the start of the broker. The kernel reports no events through it.
        Ok(data) if data.is_symlink() => {
            "has become a symbolic link, which is only followed after a restart of the broker"
                .to_owned()
        }
        Ok(_) => "is not a directory any more".to_owned(),
        Err(error) => match error.kind() {
            io::ErrorKind::TimedOut => "does not respond".to_owned(),
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => "is gone".to_owned(),
            _ => format!("cannot be accessed: {error}"),
        },
    };
    Root::Away(how)
}

/// Checks whether the path is now the empty mount point of an unmounted file system.
fn is_unmounted(root: &Path, before: Identity, now: Identity) -> bool {
    let is_empty = || foreign::access(root, || Ok(std::fs::read_dir(root)?.next().is_none()));
    before.0 != now.0 && is_empty().unwrap_or(false)
}
