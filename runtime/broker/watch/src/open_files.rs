//! Files that are open for writing, according to `/proc`. Only root can see the processes of other users.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_document::FileKind;
use qcbus_environment::is_simulated;

/// Owner write permission. In the mode of a link below `/proc/PID/fd` it means: open for writing.
const FOR_WRITING: u32 = 0o200;

/// Device and inode of files that a process has open for writing.
#[derive(Debug, Default)]
pub struct OpenFiles(HashSet<(u64, u64)>);

impl OpenFiles {
    /// Examines every process. Only files below the roots and files with checkable names count.
    pub fn look(roots: &[PathBuf]) -> OpenFiles {
        if is_simulated() {
            return OpenFiles::default();
        }
        let is_wanted = |path: &Path| {
            FileKind::of_path(path).is_some() || roots.iter().any(|root| path.starts_with(root))
        };
        let processes = entries(Path::new("/proc"));
        let processes = processes.filter(|path| path.file_name().is_some_and(is_number));
        let descriptors = processes.flat_map(|process| entries(&process.join("fd")));
        let open = descriptors.filter_map(|link| open_for_writing(&link, is_wanted));
        OpenFiles(open.collect())
    }

    /// Checks whether a file is among them.
    pub fn contains(&self, path: &Path) -> bool {
        let data = foreign::metadata(path);
        data.is_ok_and(|data| self.0.contains(&(data.dev(), data.ino())))
    }
}

/// Returns the entries of a directory. An ended process and an inaccessible one have no entries.
fn entries(directory: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    entries.map(|entry| entry.path())
}

fn is_number(name: &OsStr) -> bool {
    name.as_bytes().iter().all(u8::is_ascii_digit)
}

fn open_for_writing(link: &Path, is_wanted: impl Fn(&Path) -> bool) -> Option<(u64, u64)> {
    let target = fs::read_link(link).ok()?;
    if !target.is_absolute() || !is_wanted(&target) {
        return None;
    }
    if fs::symlink_metadata(link).ok()?.mode() & FOR_WRITING == 0 {
        return None;
    }
    // The disk of the file may not answer.
    let data = foreign::access(&target, || fs::metadata(link)).ok()?;
    Some((data.dev(), data.ino()))
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn files_open_for_writing_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        let (path, link) = (root.join("a.xodr"), root.join("link"));
        let writer = File::create(&path).unwrap();
        symlink(&path, &link).unwrap();
        let roots = [root.clone()];
        let is_open = |path: &Path| OpenFiles::look(&roots).contains(path);
        assert!(is_open(&path) && is_open(&link));
        drop(writer);
        let reader = File::open(&path).unwrap();
        assert!(!is_open(&path));
        drop(reader);
        assert!(!is_open(&root.join("nothing")));
    }
}
