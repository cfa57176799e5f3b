//! Detection of changed files.

use std::ffi::OsString;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use crate::look::Look;

/// Files, each with its fingerprint at the time of the check.
#[derive(Debug)]
pub(super) struct Stamps(Vec<(PathBuf, Option<Fingerprint>)>);

#[derive(Debug, PartialEq, Eq)]
enum Fingerprint {
    File(Look),
    /// Hash of the importable names in it. Other files, such as results, may be written there.
    Directory(u64),
}

/// Returns a time that is not before any earlier change of a file and before every future change.
///
/// Older kernels take the times of files from a coarse clock with steps of some milliseconds. Newer
/// ones also take them from the fine clock, which is ahead of the coarse one.
pub(super) fn now() -> (i64, i64) {
    let read = |clock| {
        let now = clock_gettime(clock);
        (now.tv_sec, now.tv_nsec)
    };
    let now = read(ClockId::Realtime);
    while read(ClockId::RealtimeCoarse) <= now {
        std::thread::sleep(Duration::from_millis(1));
    }
    now
}

impl Stamps {
    /// Fingerprints `files`, which were read after `begun`, a time from [`now`]. Returns a file
    /// that changed meanwhile as error, because it is unknown which version was read.
    pub(super) fn of(files: Vec<PathBuf>, begun: (i64, i64)) -> Result<Stamps, PathBuf> {
        let mut stamps = Vec::new();
        for file in files {
            let stamp = look(&file);
            let meanwhile =
                |it: &Fingerprint| matches!(it, Fingerprint::File(it) if it.changed > begun);
            if stamp.as_ref().is_none_or(meanwhile) {
                return Err(file);
            }
            stamps.push((file, stamp));
        }
        Ok(Stamps(stamps))
    }

    /// Returns a file that has changed, if there is one.
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
    Some(Fingerprint::File(Look::of(&data)))
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

/// Checks whether Python may import a directory entry: a source, a library or a directory.
pub(super) fn is_importable(name: &std::ffi::OsStr, entry: &std::fs::DirEntry) -> bool {
    let name = name.as_bytes();
    let module = [&b".py"[..], b".pyc", b".so", b".pth"];
    module.iter().any(|end| name.ends_with(end)) || entry.file_type().is_ok_and(|it| !it.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_separates_earlier_from_later_changes() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("module.py");
        for _ in 0..100 {
            std::fs::write(&file, "1").unwrap();
            // The kernel gives fine times only to files whose time was read.
            let _ = look(&file);
            std::fs::write(&file, "2").unwrap();
            let begun = now();
            assert!(Stamps::of(vec![file.clone()], begun).is_ok());
            std::fs::write(&file, "3").unwrap();
            assert!(Stamps::of(vec![file.clone()], begun).is_err());
        }
    }
}
