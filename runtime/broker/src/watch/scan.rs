//! Looking through a whole directory.

use std::io;
use std::path::{Path, PathBuf};

use qcbus_document::FileKind;
use qcbus_messages::control::Unseen;

use super::ignore::IgnoreRules;
use super::sight::{Sight, look_at};
use crate::core::Stamp;
use crate::stamp::from_metadata;

/// What a scan saw.
#[derive(Debug, Default)]
pub struct Scan {
    /// Files to check, in the order of their paths; a symbolic link to a file is one.
    pub files: Vec<(PathBuf, Stamp)>,
    /// Symbolic links whose names promise a file to check, whatever lies behind them.
    pub links: Vec<PathBuf>,
    /// What could not be looked at.
    pub unseen: Vec<Unseen>,
}

/// Every checkable file below `directory`. Symbolic links to directories are not followed: one
/// that leads to where is looked anyway adds nothing, any other is said to be unseen. `roots` are
/// all the directories that are looked at.
pub fn scan(directory: &Path, roots: &[PathBuf], rules: &mut IgnoreRules) -> Scan {
    let mut scan = Scan::default();
    let mut directories = vec![directory.to_path_buf()];
    while let Some(directory) = directories.pop() {
        let entries = match std::fs::read_dir(&directory) {
            Ok(entries) => entries,
            Err(error) => {
                scan.unseen_directory(directory, &error);
                continue;
            }
        };
        for entry in entries {
            match entry {
                Ok(entry) => directories.extend(scan.entry(&entry, roots, rules)),
                Err(error) => scan.unseen_directory(directory.clone(), &error),
            }
        }
    }
    scan.files.sort();
    scan
}

impl Scan {
    /// One entry; a directory that is to be looked into is returned.
    fn entry(
        &mut self,
        entry: &std::fs::DirEntry,
        roots: &[PathBuf],
        rules: &mut IgnoreRules,
    ) -> Option<PathBuf> {
        let path = entry.path();
        let kind = entry.file_type().ok();
        if rules.ignores(&path, kind.is_some_and(|kind| kind.is_dir())) {
            return None;
        }
        let is_checkable = FileKind::of_path(&path).is_some();
        match kind {
            Some(kind) if kind.is_dir() => return Some(path),
            // Most entries of most directories; nothing more is asked about them.
            Some(kind) if kind.is_file() && !is_checkable => return None,
            Some(kind) if kind.is_file() => {
                if let Ok(data) = entry.metadata() {
                    self.files.push((path, from_metadata(&data)));
                    return None;
                }
            }
            Some(kind) if kind.is_symlink() && is_checkable => self.links.push(path.clone()),
            _ => {}
        }
        match look_at(&path, roots) {
            Sight::Directory => return Some(path),
            Sight::File(stamp) if is_checkable => self.files.push((path, stamp)),
            Sight::NoFile(what) if is_checkable || what.hides_more() => {
                // What ends in a slash in a `.qcignore` is meant for a directory behind a link, too.
                if !rules.ignores(&path, true) {
                    let why = what.to_string();
                    self.unseen.push(Unseen { path, why });
                }
            }
            Sight::Hidden(why) => self.unseen.push(Unseen { path, why }),
            Sight::File(_) | Sight::Known | Sight::Nothing | Sight::NoFile(_) => {}
        }
        None
    }

    fn unseen_directory(&mut self, path: PathBuf, error: &io::Error) {
        // One that was removed since its name was read holds nothing.
        if error.kind() != io::ErrorKind::NotFound {
            let why = format!("cannot look into this directory: {error}");
            self.unseen.push(Unseen { path, why });
        }
    }
}
