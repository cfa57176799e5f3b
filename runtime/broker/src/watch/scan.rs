//! Looking through a whole directory.

use std::path::{Path, PathBuf};

use qcbus_document::FileKind;

use super::ignore::IgnoreRules;
use crate::core::Stamp;
use crate::stamp::from_metadata;

/// What a scan saw.
#[derive(Debug, Default)]
pub struct Scan {
    /// Files to check, in the order of their paths.
    pub files: Vec<(PathBuf, Stamp)>,
    /// Directories or files that could not be looked at, and why.
    pub failures: Vec<String>,
}

/// Every checkable file below `root`. Symbolic links are not followed.
pub fn scan(root: &Path, rules: &mut IgnoreRules) -> Scan {
    let mut scan = Scan::default();
    let mut directories = vec![root.to_path_buf()];
    while let Some(directory) = directories.pop() {
        let entries = match std::fs::read_dir(&directory) {
            Ok(entries) => entries,
            Err(error) => {
                scan.failures
                    .push(format!("cannot look into {}: {error}", directory.display()));
                continue;
            }
        };
        for entry in entries.flatten() {
            let path = entry.path();
            let Ok(kind) = entry.file_type() else {
                continue;
            };
            if rules.ignores(&path, kind.is_dir()) {
                continue;
            }
            if kind.is_dir() {
                directories.push(path);
            } else if kind.is_file()
                && FileKind::of_path(&path).is_some()
                && let Ok(data) = entry.metadata()
            {
                scan.files.push((path, from_metadata(&data)));
            }
        }
    }
    scan.files.sort();
    scan
}
