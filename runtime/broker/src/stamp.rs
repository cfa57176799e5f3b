//! What `stat` says of a file.

use std::fs::Metadata;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use qcbus_document::FileKind;

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
        mtime_ns: hash.into(),
        inode,
    })
}

/// The stamp in what `stat` returned.
pub fn from_metadata(data: &Metadata) -> Stamp {
    Stamp {
        size: data.len(),
        mtime_ns: i128::from(data.mtime()) * 1_000_000_000 + i128::from(data.mtime_nsec()),
        inode: data.ino(),
    }
}
