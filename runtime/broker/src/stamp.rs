//! What `stat` says of a file.

use std::fs::Metadata;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use qcbus_document::FileKind;
use qcbus_ingest::{Content, Stat};

use crate::core::Stamp;

/// The stamp of a regular file that is no symbolic link; `None` for anything else.
///
/// # Errors
/// Whatever `lstat` says, other than that there is no such file.
pub fn stamp_of(path: &Path) -> io::Result<Option<Stamp>> {
    match std::fs::symlink_metadata(path) {
        Ok(data) if data.is_file() => Ok(Some(from_metadata(&data))),
        Ok(_) => Ok(None),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) if error.raw_os_error() == Some(libc::ENOTDIR) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The stamp of a file that may be reached through symbolic links, as dependencies may. A
/// directory's stamp tells its scenarios: it changes when one comes or goes, not when something
/// else, such as a result, is written there.
pub fn stamp_through_links(path: &Path) -> Option<Stamp> {
    let data = std::fs::metadata(path).ok()?;
    if data.is_file() {
        Some(from_metadata(&data))
    } else if data.is_dir() {
        listing(path, data.ino())
    } else {
        None
    }
}

fn listing(directory: &Path, inode: u64) -> Option<Stamp> {
    let entries = std::fs::read_dir(directory).ok()?;
    let mut names: Vec<String> = entries
        .flatten()
        .filter(|entry| FileKind::of_path(&entry.path()) == Some(FileKind::Xosc))
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    // FNV-1a, because equal names must give equal stamps in every process.
    let bytes = names.iter().flat_map(|name| name.bytes().chain([0]));
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    Some(Stamp {
        size: names.len() as u64,
        // Not after 1970, so that nobody takes it for a time that is still young.
        mtime_ns: -i128::from(hash),
        ctime_ns: 0,
        inode,
    })
}

/// The stamp in what `stat` returned.
pub fn from_metadata(data: &Metadata) -> Stamp {
    from_stat(data.len(), Stat::of(data))
}

/// The stamp of a file as it was read.
pub fn from_content(content: &Content) -> Stamp {
    // Bytes that are of no file have the stamp of none.
    content
        .stat
        .map_or_else(Stamp::default, |stat| from_stat(content.size, stat))
}

fn from_stat(size: u64, stat: Stat) -> Stamp {
    Stamp {
        size,
        mtime_ns: stat.modified_ns,
        ctime_ns: stat.changed_ns,
        inode: stat.inode,
    }
}

/// A file that was changed this recently may change again without its stamp telling.
const RACY: Duration = Duration::from_secs(2);

/// Whether a file has changed so recently that its stamp proves nothing. Its time of change counts
/// too: a copy may carry an old modification time.
pub fn is_racy(stamp: Stamp) -> bool {
    age_of(stamp.mtime_ns.max(stamp.ctime_ns)) < nanoseconds(RACY)
}

/// Nanoseconds since then; negative for times to come.
pub fn age_of(time_ns: i128) -> i128 {
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    nanoseconds(now) - time_ns
}

fn nanoseconds(time: Duration) -> i128 {
    i128::try_from(time.as_nanos()).unwrap_or(i128::MAX)
}

#[cfg(test)]
pub(crate) mod tests {
    use std::fs::File;
    use std::io::Write;

    use super::*;

    const HOUR: Duration = Duration::from_secs(3600);

    /// Writes a file in place, so that it stays the same one, and sets its time.
    pub(crate) fn put(path: &Path, bytes: &[u8], modified: SystemTime) -> Stamp {
        let mut file = File::options()
            .create(true)
            .write(true)
            .truncate(false)
            .open(path)
            .unwrap();
        file.write_all(bytes).unwrap();
        file.set_modified(modified).unwrap();
        drop(file);
        stamp_of(path).unwrap().unwrap()
    }

    #[test]
    fn a_file_has_the_same_stamp_however_it_is_looked_at() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        let half = Duration::from_nanos(500_000_001);
        let times = [
            (SystemTime::now() - HOUR, None),
            (UNIX_EPOCH, Some(0)),
            (UNIX_EPOCH - HOUR - half, Some(-3_600_500_000_001)),
        ];
        for (time, expected) in times {
            let stamp = put(&path, b"<OpenDRIVE/>", time);
            assert_eq!(stamp_through_links(&path), Some(stamp));
            let limits = qcbus_ingest::Limits::default();
            let read = qcbus_ingest::prepare(&path, dir.path(), &limits).unwrap();
            let content = read.files()[0].content.as_ref().unwrap();
            assert_eq!(from_content(content), stamp);
            assert!(expected.is_none_or(|it| it == stamp.mtime_ns), "{stamp:?}");
        }
    }

    #[test]
    fn size_and_time_put_back_do_not_give_the_stamp_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        let time = SystemTime::now() - HOUR;
        let before = put(&path, b"one", time);
        // The clock of the file system moves in steps: only a later change is told apart.
        let after = std::iter::repeat_with(|| put(&path, b"two", time))
            .find(|after| *after != before)
            .unwrap();
        assert!(after.differs_in_ctime_only(&before));
        assert!(!before.differs_in_ctime_only(&before));
        let grown = Stamp { size: 9, ..after };
        assert!(!grown.differs_in_ctime_only(&before));
    }

    #[test]
    fn a_young_file_is_racy_however_old_it_says_that_it_is() {
        let dir = tempfile::tempdir().unwrap();
        let stamp = put(&dir.path().join("a.xodr"), b"", UNIX_EPOCH - HOUR);
        assert!(is_racy(Stamp {
            ctime_ns: stamp.ctime_ns + nanoseconds(HOUR),
            ..stamp
        }));
        assert!(!is_racy(Stamp {
            ctime_ns: stamp.ctime_ns - nanoseconds(HOUR),
            ..stamp
        }));
        let listing = stamp_through_links(dir.path()).unwrap();
        assert!(!is_racy(listing), "it has no time: {listing:?}");
    }
}
