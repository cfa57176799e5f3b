//! What goes wrong before there is a document at all.

use std::path::PathBuf;

use qcbus_messages::Absence;

use crate::limits::Exceeded;

/// What [`IngestError::NotAFile`] calls a directory.
pub(crate) const DIRECTORY: &str = "a directory";

/// Why no bytes could be had from a file. Anything wrong *inside* the bytes is a fault of the
/// document instead.
#[derive(Debug, thiserror::Error)]
pub enum IngestError {
    /// There is no file of that name (or it vanished before it could be opened).
    #[error("read {}: no such file", path.display())]
    Missing {
        /// The file looked for.
        path: PathBuf,
    },
    /// The path is a directory, a socket, a device: nothing with content to check.
    #[error("read {}: it is {what}, not a file", path.display())]
    NotAFile {
        /// The path looked at.
        path: PathBuf,
        /// `a directory`, `a device or socket`.
        what: &'static str,
    },
    /// The operating system refused: permissions, a broken disk, a lost network share.
    #[error("read {}: {source}", path.display())]
    Unreadable {
        /// The file that could not be read.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The file is larger on disk than allowed.
    #[error("read {}: {exceeded}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The cap and what was found.
        exceeded: Exceeded,
    },
    /// The file changed or vanished while it was read, several times in a row.
    #[error("read {}: it {what} while it was being read; it is read again once it has settled", path.display())]
    Unsettled {
        /// The file.
        path: PathBuf,
        /// `changed`, `was removed`.
        what: &'static str,
    },
}

impl IngestError {
    /// What it means for a file that another one refers to.
    pub fn to_absence(&self) -> Absence {
        match self {
            IngestError::Missing { .. } => Absence::NotThere,
            IngestError::NotAFile { what, .. } if *what == DIRECTORY => Absence::Directory,
            IngestError::NotAFile { .. } => Absence::NotAFile,
            IngestError::Unreadable { source, .. } => Absence::Unreadable {
                why: source.to_string(),
            },
            IngestError::TooLarge { exceeded, .. } => Absence::TooLarge {
                why: exceeded.to_string(),
            },
            IngestError::Unsettled { what, .. } => Absence::Unreadable {
                why: format!("it {what} while it was being read"),
            },
        }
    }

    /// The file that the error is about.
    pub fn path(&self) -> &std::path::Path {
        match self {
            IngestError::Missing { path }
            | IngestError::NotAFile { path, .. }
            | IngestError::Unreadable { path, .. }
            | IngestError::TooLarge { path, .. }
            | IngestError::Unsettled { path, .. } => path,
        }
    }
}
