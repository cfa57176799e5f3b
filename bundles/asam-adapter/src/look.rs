//! Detects that a file was changed or replaced, without reading it.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

/// Identity, size and change time of a file. A program cannot set the change time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Look {
    device: u64,
    inode: u64,
    size: u64,
    /// Time of the last change, in seconds and nanoseconds.
    pub changed: (i64, i64),
}

impl Look {
    /// Returns the current look of the file at a path, if there is one.
    pub fn at(path: &Path) -> Option<Look> {
        path.metadata().ok().as_ref().map(Look::of)
    }

    pub fn of(found: &Metadata) -> Look {
        Look {
            device: found.dev(),
            inode: found.ino(),
            size: found.size(),
            changed: (found.ctime(), found.ctime_nsec()),
        }
    }
}
