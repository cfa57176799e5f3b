//! Stamps of files, taken from `stat`.

use std::ffi::OsString;
use std::fs::Metadata;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use qcbus_disk::foreign;
use qcbus_document::FileKind;
use qcbus_environment::{stat, wall_time};
use qcbus_ingest::{Content, Stat};
use qcbus_types::Stamp;

/// Returns the stamp of a regular file, which may be behind a symbolic link. Returns `None` for
/// anything else, for example a dangling link or a link loop.
///
/// # Errors
/// Any error of `stat` other than a missing file, because the file may exist.
pub fn stamp_of(path: &Path) -> io::Result<Option<Stamp>> {
    match foreign::metadata(path) {
        Ok(data) if data.is_file() => Ok(Some(from_metadata(&data))),
        Ok(_) => Ok(None),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) if error.raw_os_error() == Some(libc::ENOTDIR) => Ok(None),
        // The path itself is the looping link, not a directory above a file that may exist.
        Err(error)
            if error.raw_os_error() == Some(libc::ELOOP)
                && foreign::is_symlink(path).unwrap_or(false) =>
        {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Returns the stamp of a file that may be reached through symbolic links, as dependencies may. The stamp of a
/// directory describes its scenarios: it changes when one appears or disappears, not when another file, such as a
/// result, is written there. A pipe or a device has a stamp, too, because it differs from a missing file.
pub fn stamp_through_links(path: &Path) -> Option<Stamp> {
    let data = foreign::metadata(path).ok()?;
    if data.is_file() {
        Some(from_metadata(&data))
    } else if data.is_dir() {
        listing(path, data.ino())
    } else {
        Some(Stamp {
            ctime_ns: NO_FILE,
            inode: data.ino(),
            ..Stamp::default()
        })
    }
}

/// Time of change in a directory's stamp. No file can have it, because it is centuries ago.
const LISTED: i128 = i64::MIN as i128;

/// Time of change for entries that are neither file nor directory. Their own times only show their use.
const NO_FILE: i128 = LISTED + 1;

fn listing(directory: &Path, inode: u64) -> Option<Stamp> {
    let entries = foreign::list(directory).ok()?;
    let mut names: Vec<OsString> = entries
        .iter()
        .filter(|entry| FileKind::of_path(&entry.path()) == Some(FileKind::Xosc))
        .map(|entry| entry.file_name())
        .collect();
    names.sort();
    // FNV-1a is used because equal names must give equal stamps in every process.
    let bytes = names
        .iter()
        .flat_map(|name| name.as_encoded_bytes().iter().copied().chain([0]));
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    Some(Stamp {
        size: names.len() as u64,
        // The value is not after 1970, so it never counts as a recent time.
        mtime_ns: -i128::from(hash),
        ctime_ns: LISTED,
        inode,
    })
}

/// Checks whether this is the stamp of a directory, as [`stamp_through_links`] returns it.
pub fn is_listing(stamp: &Stamp) -> bool {
    stamp.ctime_ns == LISTED
}

/// Returns the stamp from the result of `stat`.
pub fn from_metadata(data: &Metadata) -> Stamp {
    from_stat(data.len(), Stat::of(data))
}

/// Returns the stamp from the result of `fstatat`.
pub fn from_statat(data: &rustix::fs::Stat) -> Stamp {
    let time = |seconds, rest| i128::from(seconds) * 1_000_000_000 + rest;
    let told = Stat {
        modified_ns: time(data.st_mtime, i128::from(data.st_mtime_nsec)),
        changed_ns: time(data.st_ctime, i128::from(data.st_ctime_nsec)),
        inode: data.st_ino,
    };
    from_stat(u64::try_from(data.st_size).unwrap_or_default(), told)
}

/// Returns the stamp of a file as it was read.
pub fn from_content(content: &Content) -> Stamp {
    // Bytes that do not come from a file have the default stamp.
    content
        .stat
        .map_or_else(Stamp::default, |stat| from_stat(content.size, stat))
}

fn from_stat(size: u64, told: Stat) -> Stamp {
    let stat = stat(told);
    Stamp {
        size,
        mtime_ns: stat.modified_ns,
        ctime_ns: stat.changed_ns,
        inode: stat.inode,
    }
}

/// Time after a change in which a file may change again with the same stamp.
const RACY: Duration = Duration::from_secs(2);

/// Maximum time by which the clock of a file server may be ahead of the local one.
const AHEAD: Duration = Duration::from_secs(3600);

/// Checks whether a file changed so recently that its stamp proves nothing.
pub fn is_racy(stamp: Stamp) -> bool {
    is_younger(stamp, RACY)
}

/// Checks whether a file was changed within that time. Both of its times count: a copy may have an old time of
/// modification, and some file systems have no true time of change.
///
/// A modification time in the future was set explicitly and proves nothing. A time of change in the future has two
/// possible causes: another machine's clock is ahead, or the local clock was set back. More than an hour ahead only
/// the latter is possible, and then another change would have a different time.
pub fn is_younger(stamp: Stamp, limit: Duration) -> bool {
    let now = wall_time().duration_since(UNIX_EPOCH);
    was_younger(stamp, limit, nanoseconds(now.unwrap_or_default()))
}

fn was_younger(stamp: Stamp, limit: Duration, now_ns: i128) -> bool {
    let limit = nanoseconds(limit);
    let within = |time_ns, ahead: i128| (-ahead..limit).contains(&(now_ns - time_ns));
    within(stamp.mtime_ns, limit) || within(stamp.ctime_ns, nanoseconds(AHEAD))
}

fn nanoseconds(time: Duration) -> i128 {
    i128::try_from(time.as_nanos()).unwrap_or(i128::MAX)
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::Write;
    use std::time::SystemTime;

    use super::*;

    const HOUR: Duration = Duration::from_secs(3600);

    /// Writes a file in place, so that it keeps its inode, and sets its time.
    fn put(path: &Path, bytes: &[u8], modified: SystemTime) -> Stamp {
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
    fn stamp_is_same_for_every_way_of_reading() {
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
            let data = rustix::fs::stat(&path).unwrap();
            assert_eq!(from_statat(&data), stamp);
            let limits = qcbus_ingest::Limits::default();
            let read = qcbus_ingest::prepare(&path, dir.path(), &limits).unwrap();
            let content = read.files()[0].content.as_ref().unwrap();
            assert_eq!(from_content(content), stamp);
            assert!(expected.is_none_or(|it| it == stamp.mtime_ns), "{stamp:?}");
        }
    }

    #[test]
    fn restored_size_and_time_do_not_restore_stamp() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        let time = SystemTime::now() - HOUR;
        let before = put(&path, b"one", time);
        // The clock of the file system advances in steps, so only a later change is distinguishable.
        let after = std::iter::repeat_with(|| put(&path, b"two", time))
            .find(|after| *after != before)
            .unwrap();
        assert!(after.differs_in_ctime_only(&before));
        assert!(!before.differs_in_ctime_only(&before));
        let grown = Stamp { size: 9, ..after };
        assert!(!grown.differs_in_ctime_only(&before));
    }

    #[test]
    fn recently_changed_file_is_racy_despite_old_mtime() {
        let dir = tempfile::tempdir().unwrap();
        let stamp = put(&dir.path().join("a.xodr"), b"", UNIX_EPOCH - HOUR);
        let now = stamp.ctime_ns;
        let second = nanoseconds(Duration::from_secs(1));
        let racy = |stamp| was_younger(stamp, RACY, now);
        let changed = |seconds: i128| {
            let ctime_ns = now + seconds * second;
            racy(Stamp { ctime_ns, ..stamp })
        };
        assert!(changed(0) && changed(-1));
        assert!(!changed(-3));
        assert!(changed(1800), "a clock that is ahead");
        assert!(!changed(7200), "a clock that was set back");
        let listing = stamp_through_links(dir.path()).unwrap();
        assert!(!racy(listing), "it has no time: {listing:?}");
        assert!(is_listing(&listing) && !is_listing(&stamp));
        assert!(
            !is_listing(&Stamp::default()),
            "disk images contain files without times"
        );
    }

    #[test]
    fn future_modification_time_does_not_make_file_young() {
        let now = nanoseconds(HOUR);
        let second = nanoseconds(Duration::from_secs(1));
        let modified = |seconds: i128| {
            let stamp = Stamp {
                mtime_ns: now + seconds * second,
                ctime_ns: 0,
                ..Stamp::default()
            };
            was_younger(stamp, RACY, now)
        };
        assert!(modified(0) && modified(-1), "no true time of change");
        assert!(!modified(-3));
        assert!(!modified(10) && !modified(1 << 32), "set at will");
    }

    #[test]
    fn link_gives_stamp_of_its_target_or_none() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let (file, link) = (dir.path().join("a.xodr"), dir.path().join("link.xodr"));
        let stamp = put(&file, b"<OpenDRIVE/>", SystemTime::now() - HOUR);
        symlink(&file, &link).unwrap();
        assert_eq!(stamp_of(&link).unwrap(), Some(stamp));
        std::fs::remove_file(&file).unwrap();
        assert_eq!(stamp_of(&link).unwrap(), None);
        symlink(&link, &file).unwrap();
        assert_eq!(stamp_of(&link).unwrap(), None, "it leads back to itself");
        assert!(stamp_of(&link.join("b.xodr")).is_err(), "who knows?");
    }
}
