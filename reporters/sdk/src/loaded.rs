//! Loads a result from an `.xqar` on disk in the same form as a result from the broker.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::xqar::{self, Results};
use qcbus_messages::path_text::{from_text, relative, to_text};
use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};

/// Reasons why an `.xqar` could not be read.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file system returned an error.
    #[error("read {}: {source}", to_text(path))]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The file is not a result file.
    #[error("read {} as a result: {why}", to_text(path))]
    Content {
        /// Path of the file.
        path: PathBuf,
        /// Description of the fault and its place.
        why: String,
    },
}

/// Reads an `.xqar` of qcbus or of another tool. A result file has no digest of the checked file
/// and no texts of rules: `digest` is all zero and `rules` empty.
///
/// # Errors
/// [`LoadError`] when it cannot be read or is no result file.
pub fn load(path: &Path) -> Result<ResultMessage, LoadError> {
    let bytes = std::fs::read(path).map_err(|source| LoadError::Read {
        path: path.to_owned(),
        source,
    })?;
    let results = xqar::read(&bytes).map_err(|error| LoadError::Content {
        path: path.to_owned(),
        why: error.to_string(),
    })?;
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let input = input_of(&results, &absolute);
    Ok(ResultMessage {
        job: JobId(0),
        display_path: to_text(relative(&from_text(&input))),
        input,
        xqar: to_text(&absolute),
        verdict: Verdict::of(&results),
        digest: Digest::default(),
        config: Digest::default(),
        document: None,
        results,
        rules: BTreeMap::new(),
        params: Vec::new(),
    })
}

/// Returns the checked file: the first bundle's `InputFile` (or its older names). A relative path
/// starts at the directory of the result, unless it exists from the current directory.
fn input_of(results: &Results, xqar: &Path) -> String {
    let params = results.bundles.iter().flat_map(|bundle| &bundle.params);
    let named = params
        .filter(|param| qcbus_formats::config::INPUT_PARAMS.contains(&param.name.as_str()))
        .map(|param| param.value.as_str())
        .find(|value| !value.is_empty());
    let Some(named) = named else {
        return String::new();
    };
    let named = from_text(named);
    let here = std::path::absolute(&named).unwrap_or_else(|_| named.clone());
    let beside = xqar.with_file_name(&named);
    let path = if !here.exists() && beside.exists() {
        beside
    } else {
        here
    };
    to_text(&path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unreadable_result_is_reported_with_file_and_reason() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xqar");
        let missing = load(&path).unwrap_err().to_string();
        assert!(missing.contains("a.xqar"), "{missing}");
        std::fs::write(&path, "<CheckerResults").unwrap();
        let broken = load(&path).unwrap_err().to_string();
        assert!(broken.contains("as a result"), "{broken}");
    }
}
