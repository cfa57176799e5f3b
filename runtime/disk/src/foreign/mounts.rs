//! Determines the file system of a path without accessing that file system.

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

/// Returns the mount point of a path. Returns `None` for the root file system or if it is unknown.
pub(super) fn mount_of(path: &Path) -> Option<PathBuf> {
    let table = std::fs::read("/proc/self/mountinfo").ok()?;
    nearest(&table, path)
}

/// Finds the mount point, the fifth field of a table in the format of proc_pid_mountinfo(5).
fn nearest(table: &[u8], path: &Path) -> Option<PathBuf> {
    let lines = table.split(|byte| *byte == b'\n');
    let places = lines.filter_map(|line| Some(plain(line.split(|byte| *byte == b' ').nth(4)?)));
    let around = places.filter(|place| path.starts_with(place) && place.parent().is_some());
    around.max_by_key(|place| place.as_os_str().len())
}

/// Decodes spaces, line ends and backslashes, which are written as three octal digits.
fn plain(field: &[u8]) -> PathBuf {
    let (mut bytes, mut rest) = (Vec::new(), field);
    while let Some((&first, after)) = rest.split_first() {
        let digits = after.get(..3).filter(|_| first == b'\\');
        let text = digits.and_then(|it| str::from_utf8(it).ok());
        match text.and_then(|it| u8::from_str_radix(it, 8).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[3..];
            }
            None => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    OsString::from_vec(bytes).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_mount_is_found_for_any_name() {
        let table = b"22 1 8:1 / / rw - ext4 /dev/sda1 rw\n\
            30 22 0:40 / /farm rw shared:1 - nfs4 server:/farm rw\n\
            31 30 0:41 / /farm/with\\040space rw - nfs4 server:/more rw\n";
        let at = |path: &str| nearest(table, Path::new(path));
        assert_eq!(at("/farm/a.xodr"), Some("/farm".into()));
        assert_eq!(
            at("/farm/with space/a.xodr"),
            Some("/farm/with space".into())
        );
        assert_eq!(
            at("/farmer/a.xodr"),
            None,
            "the file is on the root file system"
        );
        assert_eq!(nearest(b"", Path::new("/farm")), None);
        assert_eq!(plain(b"a\\"), Path::new("a\\"), "cut off");
        let proc = mount_of(Path::new("/proc/self/maps"));
        assert!(proc.is_none_or(|it| it.starts_with("/proc")));
    }
}
