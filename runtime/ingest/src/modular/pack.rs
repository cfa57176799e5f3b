//! Packs modular scenarios into archives.

use std::collections::HashSet;
use std::io::{Cursor, Write as _};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Reason why no archive was made.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// Two files have the same name in the archive.
    #[error("pack {0}: two of the files would have this name in the archive")]
    Twice(String),
    /// The archive could not be written.
    #[error("pack {name}: {why}")]
    Unwritten {
        /// The member.
        name: String,
        /// Error text.
        why: String,
    },
}

/// Packs files into an archive, in their order. The same files give the same bytes, because the
/// time and place of packing are not stored.
///
/// # Errors
/// [`PackError`].
pub fn pack(files: &[(String, Vec<u8>)]) -> Result<Vec<u8>, PackError> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let mut names = HashSet::new();
    for (name, bytes) in files {
        if !names.insert(name) {
            return Err(PackError::Twice(name.clone()));
        }
        let failed = |why: String| PackError::Unwritten {
            name: name.clone(),
            why,
        };
        writer
            .start_file(name.as_str(), options)
            .map_err(|error| failed(error.to_string()))?;
        writer
            .write_all(bytes)
            .map_err(|error| failed(error.to_string()))?;
    }
    let archive = writer.finish().map_err(|error| PackError::Unwritten {
        name: "the archive".to_owned(),
        why: error.to_string(),
    })?;
    Ok(archive.into_inner())
}
