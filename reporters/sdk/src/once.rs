//! Runs a reporter on an existing result file, as ASAM's report modules do.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::config::{Config, same_reporter};
use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_messages::path_text::{from_text, to_text};

use crate::loaded::{LoadError, load};
use crate::output::asked;
use crate::{FileSources, Registration, ReportError, Reporter, param};

/// Name of the result file that ASAM's runtime writes. It is used if a configuration names none.
const DEFAULT_RESULT: &str = "Result.xqar";

/// Input of a single report.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OneShot {
    /// Result files. They take precedence over the configuration.
    pub results: Vec<PathBuf>,
    /// Configuration (`-c`) with the parameters of this reporter's `ReportModule`. Its `InputFile`
    /// names the result file.
    pub config: Option<PathBuf>,
    /// Parameters that take precedence over those of the configuration.
    pub params: Vec<Param>,
    /// Descriptions of rules by UID; a result file does not contain them.
    pub rules: BTreeMap<String, String>,
}

/// Reasons why a report is missing.
#[derive(Debug, thiserror::Error)]
pub enum OnceError {
    /// The configuration cannot be used.
    #[error("read the configuration {}: {why}", to_text(path))]
    Config {
        /// Path of the file.
        path: PathBuf,
        /// Description of the fault and its place.
        why: String,
    },
    /// The result file cannot be used.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The report cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// Reports on result files. Without another output parameter, each report goes to stdout, because
/// the caller wants to see it. HTML pages are written beside the results.
///
/// # Errors
/// [`OnceError`]
pub fn report_once(
    reporter: &mut dyn Reporter,
    registration: &Registration,
    what: &OneShot,
) -> Result<(), OnceError> {
    let mut params = match &what.config {
        Some(path) => configured(path, registration.name)?,
        None => Vec::new(),
    };
    params.extend(what.params.iter().cloned());
    let named = param(&params, "InputFile").map(PathBuf::from);
    let mut results = what.results.clone();
    if results.is_empty() {
        results.push(named.unwrap_or_else(|| PathBuf::from(DEFAULT_RESULT)));
    }
    if asked(&params).is_none() && !registration.is_page {
        params.push(Param {
            name: "OutputFile".into(),
            value: "__stdout__".into(),
        });
    }
    // All results are loaded before the first one is reported.
    let loaded: Result<Vec<_>, LoadError> = results.iter().map(|path| load(path)).collect();
    for mut result in loaded? {
        result.params.clone_from(&params);
        result.rules.clone_from(&what.rules);
        if let Some(why) = outdated(&result) {
            tracing::warn!("{}: {why}", result.display_path);
        }
        reporter.report(&result, &FileSources::new(&result))?;
    }
    reporter.finish()?;
    Ok(())
}

/// Returns the reason why places in a report may differ from the current file.
fn outdated(result: &ResultMessage) -> Option<&'static str> {
    let modified = |path: &str| std::fs::metadata(from_text(path)).and_then(|it| it.modified());
    if result.input.is_empty() {
        return Some("the result does not say which file was checked");
    }
    match (modified(&result.input), modified(&result.xqar)) {
        (Err(error), _) if error.kind() == std::io::ErrorKind::NotFound => {
            Some("the file does not exist any more; its lines cannot be shown")
        }
        (Err(_), _) => Some("the file cannot be accessed; its lines cannot be shown"),
        (Ok(file), Ok(checked)) if file > checked => {
            Some("the file has changed since it was checked; places refer to the checked version")
        }
        _ => None,
    }
}

/// Returns the global parameters, then those of this reporter's module. The global `InputFile` is
/// the checked file and is ignored in a report.
fn configured(path: &Path, name: &str) -> Result<Vec<Param>, OnceError> {
    let wrong = |why: String| OnceError::Config {
        path: path.to_owned(),
        why,
    };
    let bytes = std::fs::read(path).map_err(|error| wrong(error.to_string()))?;
    let parsed = Config::parse(&bytes).map_err(|error| wrong(error.to_string()))?;
    for oddity in &parsed.oddities {
        let (row, column) = (oddity.row, oddity.column);
        tracing::warn!("{}:{row}:{column}: {}", to_text(path), oddity.text);
    }
    let config = parsed.config;
    let global = config
        .params
        .iter()
        .filter(|param| !qcbus_formats::config::INPUT_PARAMS.contains(&param.name.as_str()));
    let module = config
        .reports
        .iter()
        .find(|report| same_reporter(&report.application, name));
    let own = module.iter().flat_map(|report| &report.params);
    Ok(global.chain(own).map(|param| param.to_param()).collect())
}
