//! Detects whether a user's files have changed since they were read, without reading them again.

use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::{Resource, ResourceError};

/// State of a directory (or one file) just before it was read.
pub(crate) struct Seen {
    resource: &'static Resource,
    path: PathBuf,
    files: Result<Vec<FileState>, ResourceError>,
    /// Set if a file changed so shortly before that a further change may not be visible.
    racy: bool,
}

/// State of a file. It changes if the file is written, replaced or given an old date.
#[derive(Debug, PartialEq, Eq)]
struct FileState {
    path: PathBuf,
    /// Device, inode, size and time of the last change; `None` for a file that does not exist.
    known: Option<(u64, u64, u64, SystemTime)>,
}

/// Maximum age of a change that counts as recent, because the clocks of file systems are coarse.
const RACY: Duration = Duration::from_secs(2);

impl Seen {
    pub(crate) fn new(resource: &'static Resource, path: &Path) -> Seen {
        Seen::at(SystemTime::now(), resource, path)
    }

    fn at(now: SystemTime, resource: &'static Resource, path: &Path) -> Seen {
        let files = stamps(resource, path);
        let changed = |stamp: &FileState| stamp.known.map(|(.., changed)| changed);
        let last = files.iter().flatten().filter_map(changed).max();
        Seen {
            resource,
            path: path.to_owned(),
            files,
            racy: last.is_some_and(|last| last + RACY > now),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns whether the files should be read again.
    pub(crate) fn is_outdated(&self) -> bool {
        self.racy || stamps(self.resource, &self.path) != self.files
    }
}

fn stamps(resource: &Resource, path: &Path) -> Result<Vec<FileState>, ResourceError> {
    let files = resource.listing(path)?.into_iter();
    Ok(files.map(stamp).collect())
}

fn stamp(path: PathBuf) -> FileState {
    let known = std::fs::metadata(&path).ok().map(|it| {
        let seconds = Duration::from_secs(u64::try_from(it.ctime()).unwrap_or(0));
        let rest = Duration::from_nanos(u64::try_from(it.ctime_nsec()).unwrap_or(0));
        let changed = SystemTime::UNIX_EPOCH + seconds + rest;
        (it.dev(), it.ino(), it.size(), changed)
    });
    FileState { path, known }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::Param;

    static TEXTS: Resource = Resource {
        param: Param::text("texts", "", "a directory"),
        endings: &["txt"],
        make: |_| Ok(Arc::new(())),
    };

    /// Returns the state as if seen long after the last change.
    fn later(path: &Path) -> Seen {
        Seen::at(SystemTime::now() + 2 * RACY, &TEXTS, path)
    }

    #[test]
    fn every_change_of_read_files_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path();
        let write = |name: &str, text: &str| std::fs::write(dir.join(name), text).unwrap();
        let missing = later(dir);
        assert!(!missing.is_outdated());
        write("a.txt", "1");
        assert!(missing.is_outdated());

        let changes: [(&str, &dyn Fn()); 5] = [
            ("longer", &|| write("a.txt", "12")),
            ("one more", &|| write("b.txt", "")),
            ("replaced by one of the same size and date", &|| {
                let date = std::fs::metadata(dir.join("a.txt")).unwrap().modified();
                write("new", "34");
                let new = std::fs::File::options().write(true).open(dir.join("new"));
                new.unwrap().set_modified(date.unwrap()).unwrap();
                std::fs::rename(dir.join("new"), dir.join("a.txt")).unwrap();
            }),
            ("renamed", &|| {
                std::fs::rename(dir.join("a.txt"), dir.join("c.txt")).unwrap();
            }),
            ("gone", &|| std::fs::remove_file(dir.join("b.txt")).unwrap()),
        ];
        for (what, change) in changes {
            let seen = later(dir);
            assert!(!seen.is_outdated(), "before: {what}");
            change();
            assert!(seen.is_outdated(), "{what}");
        }
        let seen = later(dir);
        write("notes.md", "not read");
        assert!(!seen.is_outdated());
    }

    #[test]
    fn recently_changed_file_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.txt"), "1").unwrap();
        let changed = std::fs::metadata(folder.path().join("a.txt")).unwrap();
        let changed = changed.modified().unwrap();
        assert!(Seen::at(changed, &TEXTS, folder.path()).is_outdated());
    }
}
