//! Conversion of a script's definitions to a bundle of the SDK.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use qcbus_document::FileKind;
use qcbus_formats::pool::{Ending, is_rule_uid};
use qcbus_formats::xqar::{Issue, Location};
use qcbus_sdk::{
    AnyRule, Backport, Bundle, Facts, Level, Loaded, Mode, Param, Plan, Reads, VersionRange,
    examine,
    run::{OwnFiles, run_or_explain},
};

use crate::rule::{PyRule, version_of};

/// Issues as dictionaries, and the checkers that could not check the file, each with the reason.
type Looked<'py> = (Bound<'py, PyList>, Vec<(String, String)>);

/// A bundle that a script describes. It is complete at its first run and does not change after
/// that.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Native {
    says: Says,
    rules: Mutex<Vec<PyRule>>,
    made: OnceLock<&'static Bundle>,
}

/// Metadata of the bundle.
struct Says {
    name: &'static str,
    alias: &'static str,
    version: &'static str,
    description: &'static str,
    kinds: &'static [FileKind],
    reads: Reads,
}

/// Leaks a text for the process lifetime, because the SDK expects constant bundles.
fn leak(text: impl Into<String>) -> &'static str {
    Box::leak(text.into().into_boxed_str())
}

fn leak_all(texts: Vec<String>) -> &'static [&'static str] {
    let texts: Vec<&'static str> = texts.into_iter().map(leak).collect();
    Box::leak(texts.into_boxed_slice())
}

#[pymethods]
impl Native {
    #[new]
    fn new(
        name: String,
        alias: String,
        version: String,
        description: String,
        kinds: Vec<String>,
        reads: &str,
    ) -> PyResult<Native> {
        let kind = |name: &String| {
            let known = FileKind::ALL.into_iter().find(|it| it.as_str() == name);
            known.ok_or_else(|| {
                let all = FileKind::ALL.map(FileKind::as_str).join(", ");
                PyValueError::new_err(format!("`{name}` is not a file kind; the kinds are {all}"))
            })
        };
        let kinds = kinds.iter().map(kind).collect::<PyResult<Vec<_>>>()?;
        let reads = match reads {
            "written" => Reads::Written,
            "expanded" => Reads::Expanded,
            _ => {
                let text = format!("reads is `{reads}`, but must be `written` or `expanded`");
                return Err(PyValueError::new_err(text));
            }
        };
        Ok(Native {
            says: Says {
                name: leak(name),
                alias: leak(alias),
                version: leak(version),
                description: leak(description),
                kinds: Box::leak(kinds.into_boxed_slice()),
                reads,
            },
            rules: Mutex::default(),
            made: OnceLock::new(),
        })
    }

    /// Adds a rule; see `qcbus.Bundle.rule`.
    #[expect(clippy::too_many_arguments, reason = "called from one place, by name")]
    #[pyo3(signature = (*, id, uids, level, versions, backport, after, params, default_on, page, function))]
    fn add(
        &self,
        id: String,
        uids: Vec<String>,
        level: &str,
        versions: String,
        backport: bool,
        after: Vec<String>,
        params: Vec<(String, Bound<'_, PyAny>, String, String)>,
        default_on: bool,
        page: String,
        function: Py<PyAny>,
    ) -> PyResult<()> {
        if self.made.get().is_some() {
            let text = "the bundle is already running: declare all rules before `main`";
            return Err(PyRuntimeError::new_err(text));
        }
        let params = params
            .into_iter()
            .map(|(name, default, unit, description)| {
                param(leak(name), &default, leak(unit), leak(description))
            });
        let params = params.collect::<PyResult<Vec<Param>>>()?;
        let facts = Facts {
            id: leak(id),
            uids: leak_all(uids),
            level: level_of(level)?,
            readers: None,
            versions: leak(versions),
            backport: match backport {
                true => Backport::Lower { since: "" },
                false => Backport::None,
            },
            after: leak_all(after),
            params: Box::leak(params.into_boxed_slice()),
            resource: None,
            default_on,
            page: leak(page),
        };
        if let Some(uid) = facts.uids.iter().find(|uid| !is_rule_uid(uid)) {
            return Err(PyValueError::new_err(format!(
                "`{uid}` is not a UID: it must have a domain with a dot, a standard, the version from which it \
                 applies and a name, of letters, digits and underscores, as in \
                 `acme.example:xodr:1.0.0:road.named`"
            )));
        }
        if let Err(error) = facts.versions.parse::<VersionRange>() {
            let text = format!("versions is `{}`: {error}", facts.versions);
            return Err(PyValueError::new_err(text));
        }
        let mut rules = self.rules.lock().unwrap_or_else(PoisonError::into_inner);
        let is_known = |id: &&&str| rules.iter().any(|rule| rule.facts.id == **id);
        if let Some(unknown) = facts.after.iter().find(|id| !is_known(id)) {
            return Err(PyValueError::new_err(format!(
                "after names `{unknown}`, but no rule before this one has that id"
            )));
        }
        rules.push(PyRule { facts, function });
        Ok(())
    }

    /// Runs the bundle according to its arguments without the interpreter's lock, and returns its
    /// exit code. The interpreter may read `reads` and list `lists` while rules run.
    fn run(
        &self,
        py: Python<'_>,
        arguments: Vec<OsString>,
        reads: Vec<PathBuf>,
        lists: Vec<PathBuf>,
    ) -> u8 {
        let bundle = self.bundle();
        log();
        let own = OwnFiles {
            reads,
            lists,
            restricted: false,
        };
        // Only one thread at a time can run Python. More threads would only wait for each other.
        let mode = Mode::parse(arguments).map(|mode| mode.with_threads(1).reading(own));
        py.detach(|| run_or_explain(bundle, mode).code())
    }

    /// Checks a text with one rule, or with all rules if no name is given. Returns the issues and
    /// the failures.
    #[pyo3(signature = (path, text, rule=None))]
    fn check<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        text: Vec<u8>,
        rule: Option<String>,
    ) -> PyResult<Looked<'py>> {
        let bundle = self.bundle();
        let failed =
            |error: &dyn std::fmt::Display| PyRuntimeError::new_err(format!("failed to {error}"));
        let outcome = py.detach(|| {
            let loaded = Loaded::from_bytes(&path, text).map_err(|error| error.to_string())?;
            let plan = Plan::by_default(bundle);
            examine(&plan, &loaded).map_err(|error| error.to_string())
        });
        let outcome = outcome.map_err(|error| failed(&error))?;
        let found = PyList::empty(py);
        let mut unlooked = Vec::new();
        for checker in outcome.checkers {
            if rule.as_deref().is_some_and(|rule| *rule != *checker.id) {
                continue;
            }
            if let Some(ending) = checker.ending.filter(|it| *it != Ending::Completed) {
                unlooked.push((checker.id.to_string(), ending.reason().to_owned()));
            }
            for issue in &checker.issues {
                found.append(describe(py, &checker.id, issue)?)?;
            }
        }
        Ok((found, unlooked))
    }
}

impl Native {
    fn bundle(&self) -> &'static Bundle {
        self.made.get_or_init(|| {
            let mut rules = self.rules.lock().unwrap_or_else(PoisonError::into_inner);
            let rules: Vec<&'static dyn AnyRule> = rules
                .drain(..)
                .map(|rule| &*Box::leak(Box::new(rule)) as &'static dyn AnyRule)
                .collect();
            Box::leak(Box::new(Bundle {
                name: self.says.name,
                alias: self.says.alias,
                version: self.says.version,
                description: self.says.description,
                standard: match self.says.kinds {
                    [FileKind::Xodr] => "OpenDRIVE",
                    _ => "OpenSCENARIO",
                },
                kinds: self.says.kinds,
                versions: &[],
                reads: self.says.reads,
                version_of,
                rules: Box::leak(rules.into_boxed_slice()),
            }))
        })
    }
}

/// Sends log events to stderr, as the program `qcbus` does. `QCBUS_LOG` selects the events.
fn log() {
    use tracing_subscriber::EnvFilter;
    let filter = EnvFilter::try_from_env("QCBUS_LOG").unwrap_or_else(|_| EnvFilter::new("warn"));
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .log_internal_errors(false)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::IsTerminal::is_terminal(&std::io::stderr()));
    // A second subscriber cannot be set. The first one stays in force.
    let _ = tracing::subscriber::set_global_default(subscriber.finish());
}

fn param(
    name: &'static str,
    default: &Bound<'_, PyAny>,
    unit: &'static str,
    description: &'static str,
) -> PyResult<Param> {
    // A bool is also a number in Python, so it is tested first.
    if let Ok(flag) = default.cast::<pyo3::types::PyBool>() {
        return Ok(Param::flag(name, flag.is_true(), description));
    }
    if let Ok(number) = default.extract::<f64>() {
        return Ok(Param::number(name, number, unit, description));
    }
    match default.extract::<String>() {
        Ok(text) => Ok(Param::text(name, leak(text), description)),
        Err(_) => Err(PyValueError::new_err(format!(
            "the default of the parameter `{name}` must be a number, True, False or a text"
        ))),
    }
}

/// Returns the level of a name, as used in rules and findings.
///
/// # Errors
/// `ValueError`, if the level does not exist.
pub(crate) fn level_of(name: &str) -> PyResult<Level> {
    match name {
        "error" => Ok(Level::Error),
        "warning" => Ok(Level::Warning),
        "information" | "info" => Ok(Level::Information),
        _ => Err(PyValueError::new_err(format!(
            "`{name}` is not a level: use error, warning or information"
        ))),
    }
}

fn describe<'py>(py: Python<'py>, checker: &str, issue: &Issue) -> PyResult<Bound<'py, PyDict>> {
    let said = PyDict::new(py);
    said.set_item("checker", checker)?;
    said.set_item("text", &issue.description)?;
    said.set_item("level", issue.level.as_str())?;
    said.set_item("uid", &issue.rule_uid)?;
    let places = issue
        .locations
        .first()
        .map(|it| it.places.as_slice())
        .unwrap_or_default();
    for place in places {
        match place {
            Location::File { row, column, .. } => {
                said.set_item("row", row)?;
                said.set_item("column", column)?;
            }
            Location::Xml { xpath } => said.set_item("xpath", xpath)?,
            _ => {}
        }
    }
    Ok(said)
}
