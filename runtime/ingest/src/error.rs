//! Errors that occur before a document exists.

use std::path::PathBuf;

use qcbus_messages::Absence;

use crate::limits::Exceeded;

/// Text of [`IngestError::NotAFile`] for a directory.
pub(crate) const DIRECTORY: &str = "a directory";

/// Reason why a file could not be read. An error *inside* the bytes is a fault of the document
/// instead.
#[derive(Debug, thiserror::Error)]
pub enum IngestError {
    /// The file does not exist (or it vanished before it could be opened).
    #[error("read {}: no such file", path.display())]
    Missing {
        /// The missing file.
        path: PathBuf,
    },
    /// The path is a directory, a socket or a device, without content to check.
    #[error("read {}: it is {what}, not a file", path.display())]
    NotAFile {
        /// The examined path.
        path: PathBuf,
        /// `a directory`, `a device or socket`.
        what: &'static str,
    },
    /// The operating system refused access: permissions, a broken disk or a lost network share.
    #[error("read {}: {source}", path.display())]
    Unreadable {
        /// The file that could not be read.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger on disk than allowed.
    #[error("read {}: {exceeded}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The cap and the value found.
        exceeded: Exceeded,
    },
    /// The file changed or vanished during each of several consecutive reads.
    #[error("read {}: it {what} while it was being read; it is read again when it no longer changes", path.display())]
    Unsettled {
        /// The file.
        path: PathBuf,
        /// `changed`, `was removed`.
        what: &'static str,
    },
}

impl IngestError {
    /// Returns the matching [`Absence`] for a file that another one refers to.
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

    /// Returns the file of the error.
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
