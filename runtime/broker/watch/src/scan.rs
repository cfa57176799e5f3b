//! Scanning of directories.

use std::collections::VecDeque;
use std::ffi::OsStr;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::slice;

use qcbus_disk::foreign;
use qcbus_document::FileKind;
use qcbus_messages::control::Unseen;
use qcbus_types::Stamp;
use rustix::fs::{AtFlags, Dir, FileType};

use super::file_lookup::{FileLookup, look_at, open_directory};
use super::ignore::{IgnoreRules, ignores, passes_over};
use crate::stamp::from_statat;

/// Maximum depth of scanned directories below a root. It exceeds real directory trees, but keeps
/// paths short enough to name the files there.
pub const DEEPEST: usize = 128;

/// Maximum number of scanned directories in total.
pub const MOST_DIRECTORIES: usize = 500_000;

/// Maximum number of inaccessible paths that are listed individually.
pub const MOST_UNSEEN: usize = 1_000;

/// Text that represents all further inaccessible paths.
pub const MORE_UNSEEN: &str =
    "more than a thousand paths below cannot be accessed; only the first ones are listed";

/// Result of a scan.
#[derive(Debug, Default)]
pub struct Scan {
    /// Files to check, sorted by path. A symbolic link to a file counts as one.
    pub files: Vec<(PathBuf, Stamp)>,
    /// Inaccessible paths. If there are too many, one entry represents the rest.
    pub unseen: Vec<Unseen>,
}

/// Returns every checkable file below `directory`. Symbolic links to directories are not followed.
/// A link to a directory that is scanned anyway is ignored; any other link is reported as
/// inaccessible. `roots` are all scanned directories.
pub fn scan(directory: &Path, roots: &[PathBuf], rules: &mut IgnoreRules) -> Scan {
    let mut scan = Scan::default();
    let mut directories = VecDeque::from([directory.to_path_buf()]);
    let mut number = 0;
    while let Some(at) = directories.pop_front() {
        number += 1;
        if let Some(why) = is_too_much(&at, roots, number) {
            scan.unseen.push(Unseen { path: at, why });
            continue;
        }
        let found = list(&at, roots, slice::from_mut(rules));
        let mut inner = found.directories;
        inner.retain(|it| !rules.ignores(it, true));
        directories.extend(inner);
        scan.files.extend(found.files);
        let why = found.broken.and_then(|error| cannot_look_into(&error));
        let broken = why.map(|why| Unseen { path: at, why });
        scan.unseen.extend(found.unseen.into_iter().chain(broken));
        scan.unseen.truncate(MOST_UNSEEN + 1);
    }
    if let Some(one_too_many) = scan.unseen.get_mut(MOST_UNSEEN) {
        let (path, why) = (directory.to_path_buf(), MORE_UNSEEN.to_owned());
        *one_too_many = Unseen { path, why };
    }
    scan.files.sort();
    scan
}

/// Returns why a directory exceeds the limits and is not scanned. `number` is the count including it.
pub fn is_too_much(directory: &Path, roots: &[PathBuf], number: usize) -> Option<String> {
    let inside = roots
        .iter()
        .filter_map(|root| directory.strip_prefix(root).ok());
    let depth = inside.map(|below| below.components().count()).min();
    if depth.is_some_and(|depth| depth > DEEPEST) {
        Some(format!(
            "it is more than {DEEPEST} directories deep, and such directories are not scanned"
        ))
    } else if number > MOST_DIRECTORIES {
        Some(format!(
            "there are more than {MOST_DIRECTORIES} directories, and further ones are not scanned"
        ))
    } else {
        None
    }
}

/// Returns the message about an unreadable directory. Returns `None` if it was removed since its
/// name was read, or has become a link.
pub fn cannot_look_into(error: &io::Error) -> Option<String> {
    let is_gone = matches!(
        error.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
    );
    let is_link = error.raw_os_error() == Some(libc::ELOOP);
    (!is_gone && !is_link).then(|| format!("cannot read this directory: {error}"))
}

/// Entries of one directory.
#[derive(Debug, Default)]
pub struct Listing {
    /// Files to check, sorted by name.
    pub files: Vec<(PathBuf, Stamp)>,
    /// Symbolic links with names of checkable files, whatever their targets are.
    pub links: Vec<PathBuf>,
    /// Directories to scan, including those that a `.qcignore` excludes: other files may depend on files there.
    pub directories: Vec<PathBuf>,
    /// Inaccessible paths.
    pub unseen: Vec<Unseen>,
    /// Error because of which the listing may be incomplete.
    pub broken: Option<io::Error>,
}

/// Lists one directory. Does not follow a link that has replaced a part of its path.
pub fn list(directory: &Path, roots: &[PathBuf], rules: &mut [IgnoreRules]) -> Listing {
    let mut listing = Listing::default();
    let read = foreign::access(directory, || {
        let mut opened = Dir::new(open_directory(directory, roots)?)?;
        listing.read(directory, &mut opened, roots, rules);
        Ok(())
    });
    listing.broken = read.err().or(listing.broken);
    listing.files.sort();
    listing
}

impl Listing {
    fn read(
        &mut self,
        directory: &Path,
        opened: &mut Dir,
        roots: &[PathBuf],
        rules: &mut [IgnoreRules],
    ) {
        while let Some(entry) = opened.read() {
            let entry = match entry {
                Ok(entry) => entry,
                Err(error) => {
                    self.broken = Some(error.into());
                    return;
                }
            };
            let name = OsStr::from_bytes(entry.file_name().to_bytes());
            if name == "." || name == ".." {
                continue;
            }
            let path = directory.join(name);
            let is_checkable = FileKind::of_path(&path).is_some();
            match entry.file_type() {
                // Most entries are such files, so they need no further system call.
                FileType::RegularFile if !is_checkable => {}
                FileType::RegularFile => {
                    let data = foreign::access(&path, || {
                        let (fd, name) = (opened.fd()?, entry.file_name());
                        Ok(rustix::fs::statat(fd, name, AtFlags::SYMLINK_NOFOLLOW)?)
                    });
                    match data {
                        Ok(data) if FileType::from_raw_mode(data.st_mode).is_file() => {
                            self.file(path, from_statat(&data), rules);
                        }
                        // The file type has changed since the entry was read.
                        _ => self.other(path, is_checkable, roots, rules),
                    }
                }
                FileType::Directory => self.directory(path, rules),
                _ => self.other(path, is_checkable, roots, rules),
            }
        }
    }

    fn file(&mut self, path: PathBuf, stamp: Stamp, rules: &mut [IgnoreRules]) {
        if !ignores(rules, &path, false) {
            self.files.push((path, stamp));
        }
    }

    fn directory(&mut self, path: PathBuf, rules: &mut [IgnoreRules]) {
        if !passes_over(rules, &path) {
            self.directories.push(path);
        }
    }

    /// Handles a link, or an entry with a type that only a lookup can determine.
    fn other(
        &mut self,
        path: PathBuf,
        is_checkable: bool,
        roots: &[PathBuf],
        rules: &mut [IgnoreRules],
    ) {
        // A pattern with a trailing slash in a `.qcignore` also applies to a link to a directory.
        if ignores(rules, &path, false) || ignores(rules, &path, true) {
            return;
        }
        if is_checkable {
            self.links.push(path.clone());
        }
        match look_at(&path, roots) {
            FileLookup::Directory => self.directory(path, rules),
            FileLookup::File(stamp) if is_checkable => self.files.push((path, stamp)),
            FileLookup::NoFile(what) if is_checkable || what.hides_more() => {
                let why = what.to_string();
                self.unseen.push(Unseen { path, why });
            }
            FileLookup::Hidden(why) => self.unseen.push(Unseen { path, why }),
            FileLookup::File(_)
            | FileLookup::Known
            | FileLookup::Nothing
            | FileLookup::NoFile(_) => {}
        }
    }
}
