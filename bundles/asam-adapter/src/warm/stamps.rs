//! Whether files are still those that they were.

use std::ffi::OsString;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Files, and what told them from others when they were looked at.
#[derive(Debug)]
pub(super) struct Stamps(Vec<(PathBuf, Option<Fingerprint>)>);

#[derive(Debug, PartialEq, Eq)]
enum Fingerprint {
    File {
        device: u64,
        inode: u64,
        size: u64,
        modified: (i64, i64),
        changed: (i64, i64),
    },
    /// A hash of the names in it that can be imported. Results may be written there.
    Directory(u64),
}

/// A time that every file of before is older than, and no file that is changed from now on.
///
/// File systems take their times from a clock that goes in steps of some milliseconds: it is the next of those.
pub(super) fn now() -> (i64, i64) {
    let coarse = || {
        let now = clock_gettime(ClockId::RealtimeCoarse);
        (now.tv_sec, now.tv_nsec)
    };
    let begun = coarse();
    while coarse() == begun {
        std::thread::sleep(Duration::from_millis(1));
    }
    coarse()
}

impl Stamps {
    /// Looks at `files`, which somebody has read since `begun`, a time that [`now`] gave. Gives the file that changed meanwhile, if one did: what was
    /// read may have been either.
    pub(super) fn of(files: Vec<PathBuf>, begun: (i64, i64)) -> Result<Stamps, PathBuf> {
        let mut stamps = Vec::new();
        for file in files {
            let stamp = look(&file);
            let meanwhile = |it: &Fingerprint| matches!(it, Fingerprint::File { changed, .. } if *changed >= begun);
            if stamp.as_ref().is_none_or(meanwhile) {
                return Err(file);
            }
            stamps.push((file, stamp));
        }
        Ok(Stamps(stamps))
    }

    /// A file that is no longer the same.
    pub(super) fn changed(&self) -> Option<&Path> {
        let changed = self.0.iter().find(|(file, stamp)| look(file) != *stamp);
        changed.map(|(file, _)| file.as_path())
    }
}

fn look(file: &Path) -> Option<Fingerprint> {
    let data = file.metadata().ok()?;
    if data.is_dir() {
        return importable(file).map(Fingerprint::Directory);
    }
    Some(Fingerprint::File {
        device: data.dev(),
        inode: data.ino(),
        size: data.size(),
        modified: (data.mtime(), data.mtime_nsec()),
        changed: (data.ctime(), data.ctime_nsec()),
    })
}

fn importable(directory: &Path) -> Option<u64> {
    let mut names: Vec<OsString> = Vec::new();
    for entry in directory.read_dir().ok()? {
        let entry = entry.ok()?;
        let name = entry.file_name();
        if is_importable(&name, &entry) && name != "__pycache__" {
            names.push(name);
        }
    }
    names.sort_unstable();
    let mut hasher = DefaultHasher::new();
    names.hash(&mut hasher);
    Some(hasher.finish())
}

/// Whether Python would look at an entry of a directory for modules: sources, libraries, and directories.
pub(super) fn is_importable(name: &std::ffi::OsStr, entry: &std::fs::DirEntry) -> bool {
    let name = name.as_bytes();
    let module = [&b".py"[..], b".pyc", b".so", b".pth"];
    module.iter().any(|end| name.ends_with(end)) || entry.file_type().is_ok_and(|it| !it.is_file())
}
