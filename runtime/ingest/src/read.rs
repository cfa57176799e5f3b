//! Reads bytes from disk, with a stamp that identifies them.

use std::fs::{File, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign::{self, Refused};
use sha2::{Digest, Sha256};

use crate::error::IngestError;
use crate::limits::{Exceeded, Limits};

/// One file that a document was made from, or that was looked for and not found. Watching these
/// paths shows when the document is out of date.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileStamp {
    /// Absolute path.
    pub path: PathBuf,
    /// Content found there. `None` when the file was missing or could not be read.
    pub content: Option<Content>,
}

/// The bytes behind a [`FileStamp`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Content {
    /// Size on disk in bytes.
    pub size: u64,
    /// Further data of `stat`. `None` if the bytes came from memory.
    pub stat: Option<Stat>,
    /// SHA-256 of the bytes on disk.
    pub digest: [u8; 32],
}

/// Data of `stat` except for the size. It is valid for the whole read: none of its values changed
/// between the first byte and the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stat {
    /// Inode number.
    pub inode: u64,
    /// Time of the last modification, in nanoseconds since 1970. Earlier times are negative.
    pub modified_ns: i128,
    /// Time of the last change of data or metadata (ctime). Users cannot set it to an arbitrary
    /// value.
    pub changed_ns: i128,
}

impl Stat {
    /// Takes the values from the metadata.
    pub fn of(metadata: &Metadata) -> Stat {
        use std::os::unix::fs::MetadataExt;
        let nanoseconds =
            |seconds: i64, rest: i64| i128::from(seconds) * 1_000_000_000 + i128::from(rest);
        Stat {
            inode: metadata.ino(),
            modified_ns: nanoseconds(metadata.mtime(), metadata.mtime_nsec()),
            changed_ns: nanoseconds(metadata.ctime(), metadata.ctime_nsec()),
        }
    }
}

/// Bytes and stamp of one file.
pub(crate) struct RawFile {
    pub bytes: Vec<u8>,
    pub stamp: FileStamp,
}

impl RawFile {
    /// Computes the digest of the bytes. It is missing after [`read_unhashed`].
    pub fn hash(&mut self) {
        self.stamp.hash(&self.bytes);
    }
}

impl FileStamp {
    /// Computes the digest. `bytes` must be the bytes of the file.
    pub(crate) fn hash(&mut self, bytes: &[u8]) {
        if let Some(content) = &mut self.content {
            content.digest = sha256(bytes);
        }
    }
}

/// Maximum number of attempts to read a file that changes during the read.
const ATTEMPTS: usize = 3;

/// Reads a whole file. The metadata before and after prove that the file was not written to in
/// between.
pub(crate) fn read_file(path: &Path, limits: &Limits) -> Result<RawFile, IngestError> {
    let mut raw = read_unhashed(path, limits)?;
    raw.hash();
    Ok(raw)
}

/// Reads a file as [`read_file`] does, but without computing the digest.
pub(crate) fn read_unhashed(path: &Path, limits: &Limits) -> Result<RawFile, IngestError> {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut outcome = "changed";
    for _ in 0..ATTEMPTS {
        match read_once(&path, limits, |file, bytes, cap| {
            foreign::read_on(&path, file, cap, bytes)
        })? {
            Attempt::Stable(raw) => return Ok(raw),
            Attempt::Changed => outcome = "changed",
            Attempt::Removed => outcome = "was removed",
        }
    }
    Err(IngestError::Unsettled {
        path,
        what: outcome,
    })
}

/// Returns the stamp of bytes that were passed in memory.
pub(crate) fn stamp_of_bytes(path: &Path, bytes: &[u8]) -> FileStamp {
    let content = Content {
        size: bytes.len() as u64,
        stat: None,
        digest: sha256(bytes),
    };
    FileStamp {
        path: path.to_path_buf(),
        content: Some(content),
    }
}

/// Returns the SHA-256 as `sha256sum` computes it.
pub(crate) fn sha256(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

enum Attempt {
    Stable(RawFile),
    Changed,
    Removed,
}

/// Makes one attempt to read a file. `fill` does the reading, so that a test can change the file
/// during it.
fn read_once(
    path: &Path,
    limits: &Limits,
    fill: impl FnOnce(&mut File, &mut Vec<u8>, u64) -> io::Result<()>,
) -> Result<Attempt, IngestError> {
    let fail = |source| unreadable(path, source);
    let (mut file, before) = foreign::open(path).map_err(|it| refused(path, it))?;
    let too_large = |exceeded| IngestError::TooLarge {
        path: path.to_path_buf(),
        exceeded,
    };
    Exceeded::check("max_file", "bytes on disk", before.len(), limits.max_file)
        .map_err(too_large)?;
    let mut bytes = Vec::with_capacity(usize::try_from(before.len()).unwrap_or(0) + 1);
    ask_for_huge_pages(&mut bytes);
    fill(&mut file, &mut bytes, limits.max_file.saturating_add(1)).map_err(fail)?;
    Exceeded::check(
        "max_file",
        "bytes on disk",
        bytes.len() as u64,
        limits.max_file,
    )
    .map_err(too_large)?;
    let after = match foreign::metadata(path) {
        Ok(after) => after,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Attempt::Removed),
        Err(error) => return Err(fail(error)),
    };
    if !same_file(&before, &after) || bytes.len() as u64 != after.len() {
        return Ok(Attempt::Changed);
    }
    let content = Content {
        size: after.len(),
        stat: Some(Stat::of(&after)),
        digest: [0; 32],
    };
    let stamp = FileStamp {
        path: path.to_path_buf(),
        content: Some(content),
    };
    Ok(Attempt::Stable(RawFile { bytes, stamp }))
}

/// Size from which glibc uses a separate mapping for an allocation and unmaps it when it is freed.
const OWN_MAPPING: usize = 32 << 20;

/// Asks the kernel for huge pages for a large buffer, because faulting in small pages costs three
/// times as much as reading into them. A smaller buffer may be in the heap, which would keep the
/// advice for later allocations.
fn ask_for_huge_pages(bytes: &mut Vec<u8>) {
    let room = bytes.spare_capacity_mut();
    if room.len() < OWN_MAPPING {
        return;
    }
    let page = rustix::param::page_size();
    let start = room.as_mut_ptr();
    let lead = start.addr().next_multiple_of(page) - start.addr();
    let whole = (room.len() - lead) / page * page;
    let first: *mut std::ffi::c_void = start.wrapping_add(lead).cast();
    // The error is ignored, because small pages are used if huge ones are not available.
    #[expect(unsafe_code, reason = "madvise takes raw pointers")]
    // SAFETY: the pages lie wholly in the buffer. The advice changes no byte of them.
    let _ = unsafe { rustix::mm::madvise(first, whole, rustix::mm::Advice::LinuxHugepage) };
}

fn refused(path: &Path, refused: Refused) -> IngestError {
    let what = match refused {
        Refused::Directory => crate::error::DIRECTORY,
        Refused::Special(what) => what,
        Refused::System(source) => return unreadable(path, source),
    };
    IngestError::NotAFile {
        path: path.to_path_buf(),
        what,
    }
}

fn unreadable(path: &Path, source: io::Error) -> IngestError {
    let path = path.to_path_buf();
    match source.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => IngestError::Missing { path },
        _ => IngestError::Unreadable { path, source },
    }
}

fn same_file(before: &Metadata, after: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    let key = |m: &Metadata| (m.dev(), m.size());
    key(before) == key(after) && Stat::of(before) == Stat::of(after)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write;

    use super::*;

    fn read_while(path: &Path, meanwhile: impl FnOnce(&Path)) -> Result<Attempt, IngestError> {
        read_once(path, &Limits::default(), |file, bytes, cap| {
            let read = foreign::read_on(path, file, cap, bytes);
            meanwhile(path);
            read
        })
    }

    #[test]
    fn file_removed_while_being_read_is_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        fs::write(&path, "<OpenDRIVE/>").unwrap();
        let attempt = read_while(&path, |path| fs::remove_file(path).unwrap());
        assert!(matches!(attempt, Ok(Attempt::Removed)));
        assert!(matches!(
            read_file(&path, &Limits::default()),
            Err(IngestError::Missing { .. })
        ));
    }

    #[test]
    fn file_changed_or_replaced_while_being_read_is_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        fs::write(&path, "<OpenDRIVE/>").unwrap();
        let grown = read_while(&path, |path| {
            File::options()
                .append(true)
                .open(path)
                .unwrap()
                .write_all(b"<!-- -->")
                .unwrap();
        });
        assert!(matches!(grown, Ok(Attempt::Changed)));
        let replaced = read_while(&path, |path| {
            let other = path.with_extension("new");
            fs::write(&other, fs::read(path).unwrap()).unwrap();
            fs::rename(other, path).unwrap();
        });
        assert!(matches!(replaced, Ok(Attempt::Changed)));
        assert!(matches!(read_while(&path, |_| ()), Ok(Attempt::Stable(_))));
    }

    #[test]
    fn directories_devices_and_large_files_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("x.xodr");
        fs::create_dir(&path).unwrap();
        let error = read_file(&path, &Limits::default()).err().unwrap();
        assert!(
            error.to_string().ends_with("it is a directory, not a file"),
            "{error}"
        );
        let error = read_file(Path::new("/dev/zero"), &Limits::default())
            .err()
            .unwrap();
        assert!(matches!(error, IngestError::NotAFile { .. }));

        let path = dir.path().join("large.xodr");
        fs::write(&path, "<OpenDRIVE/>").unwrap();
        let limits = Limits {
            max_file: 5,
            ..Limits::default()
        };
        let error = read_file(&path, &limits).err().unwrap();
        assert!(
            error
                .to_string()
                .ends_with("12 bytes on disk, 5 are allowed; raise the limit max_file to read it"),
            "{error}"
        );
    }

    #[test]
    fn digest_matches_sha256sum() {
        let hex: String = sha256(b"abc")
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        assert!(hex.starts_with("ba7816bf8f01cfea414140de5dae2223"));
    }
}
