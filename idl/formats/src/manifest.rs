//! Manifests (`.json`): the available modules and their commands.
//!
//! A framework manifest lists module manifests; a module manifest lists modules. The caller
//! provides functions that read files and environment variables.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::distance::{closest, did_you_mean};

/// A module that can be started.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Module {
    /// Its name: `application` of a configuration. Unique for each type.
    pub name: String,
    /// Type of the module.
    pub module_type: ModuleType,
    /// The command for a shell.
    pub exec_command: String,
    /// How it is started.
    pub mode: Mode,
    /// Permissions besides checking.
    pub may: May,
    /// Whether it runs as a shadow, with no effect on any verdict: `"shadow": true`.
    pub shadow: bool,
    /// Run settings of a module that is started for every file.
    pub once: Once,
    /// Keys that begin with `qcbus`, and the keys `version` and `restart`, for other readers. All
    /// values are stored as text, sorted by name.
    pub extra: Vec<(String, String)>,
    /// The manifest that contains it.
    pub manifest: PathBuf,
}

/// Type of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModuleType {
    /// A module that checks files.
    CheckerBundle,
    /// A module that writes reports.
    ReportModule,
    /// A module that pools results. qcbus pools results itself and never starts one.
    ResultPooling,
}

/// How a module is started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Started once for a file, as ASAM's framework does.
    #[default]
    Once,
    /// A daemon that joins the bus: `"mode": "bus"`.
    Bus,
}

/// Permissions of a module in the sandbox: the key `may`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct May {
    /// Files and directories that it may read.
    pub read: Vec<PathBuf>,
    /// Files and directories that it may write.
    pub write: Vec<PathBuf>,
    /// Whether it may use the network.
    pub network: bool,
    /// Whether it may start programs.
    pub programs: bool,
}

/// Run settings of a module that is started once for a file, in addition to its command.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Once {
    /// The name of its section in a configuration, if that differs from its own name.
    pub application: Option<String>,
    /// Its working directory, if that is not its private directory.
    pub working_directory: Option<PathBuf>,
    /// Additional environment variables, by name.
    pub environment: Vec<(String, String)>,
    /// The kinds of files that it accepts (`xodr`), if they cannot be queried from the module.
    pub kinds: Vec<String>,
    /// Whether every run starts from scratch, even if data could be cached: `"warm": false`.
    pub cold: bool,
    /// Resource limits of a run, by name: whole numbers above zero.
    pub limits: Vec<(String, u64)>,
}

/// A manifest that cannot be used. The text names the file and the key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ManifestError {
    /// The file could not be read.
    #[error("{}: {reason}{}", .path.display(), named_by(.listed_in))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
        /// The framework manifest that lists it.
        listed_in: Option<PathBuf>,
    },
    /// The file is not JSON.
    #[error("{}:{row}:{column}: not JSON: {reason}", .path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// Description of the error.
        reason: String,
    },
    /// A key is missing or has a wrong value.
    #[error("{}: `{key}` {reason}", .path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// Path of the key, such as `module[2].exec_command`.
        key: String,
        /// Description of the error.
        reason: String,
    },
}

fn named_by(listed_in: &Option<PathBuf>) -> String {
    match listed_in {
        Some(path) => format!(" (listed in `manifest_file_path` of {})", path.display()),
        None => String::new(),
    }
}

/// Functions to read manifests.
pub struct Sources<'f> {
    /// Reads a file, or returns the reason why it cannot be read.
    pub read: &'f dyn Fn(&Path) -> Result<Vec<u8>, String>,
    /// Returns the value of an environment variable.
    pub variable: &'f dyn Fn(&str) -> Option<String>,
}

impl std::fmt::Debug for Sources<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Sources")
    }
}

/// Reads a framework manifest and all listed manifests, or a single module manifest. Relative paths
/// in a framework manifest stay unchanged. They are relative to the current directory, as in ASAM's
/// framework.
///
/// # Errors
/// A file cannot be read or is not JSON, a key is missing or wrong, a name is used twice.
pub fn load(path: &Path, sources: &Sources<'_>) -> Result<Vec<Module>, ManifestError> {
    let bytes = read(path, None, sources)?;
    let object = object(path, &bytes)?;
    let modules = if object.contains_key("manifest_file_path") {
        let mut modules = Vec::new();
        for listed in listed_files(path, &object, sources)? {
            let bytes = read(&listed, Some(path), sources)?;
            modules.extend(parse_modules(&listed, &bytes)?);
        }
        modules
    } else {
        modules_of(path, &object)?
    };
    unique(modules)
}

/// Returns the modules of a module manifest.
///
/// # Errors
/// The file is not JSON, or a key is missing or wrong.
pub fn parse_modules(path: &Path, bytes: &[u8]) -> Result<Vec<Module>, ManifestError> {
    modules_of(path, &object(path, bytes)?)
}

/// Expands `$NAME` and `${NAME}`. Unset variables and a single `$` stay unchanged.
pub fn expand(text: &str, variable: &dyn Fn(&str) -> Option<String>) -> String {
    let mut expanded = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('$') {
        expanded.push_str(&rest[..at]);
        let behind = &rest[at + 1..];
        let (name, length) = match behind.strip_prefix('{').and_then(|b| b.split_once('}')) {
            Some((name, _)) => (name, name.len() + 2),
            None => {
                let end = behind.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
                let name = &behind[..end.unwrap_or(behind.len())];
                (name, name.len())
            }
        };
        match variable(name).filter(|_| !name.is_empty()) {
            Some(value) => expanded.push_str(&value),
            None => expanded.push_str(&rest[at..at + 1 + length]),
        }
        rest = &behind[length..];
    }
    expanded.push_str(rest);
    expanded
}

fn read(
    path: &Path,
    listed_in: Option<&Path>,
    sources: &Sources<'_>,
) -> Result<Vec<u8>, ManifestError> {
    (sources.read)(path).map_err(|reason| ManifestError::Unreadable {
        path: path.to_owned(),
        reason,
        listed_in: listed_in.map(Path::to_owned),
    })
}

fn object(path: &Path, bytes: &[u8]) -> Result<Map<String, Value>, ManifestError> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match serde_json::from_slice(bytes) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => Err(ManifestError::Syntax {
            path: path.to_owned(),
            row: 1,
            column: 1,
            reason: String::from("a manifest must be an object"),
        }),
        Err(error) => {
            let reason = error.to_string();
            let reason = reason
                .split(" at line ")
                .next()
                .unwrap_or_default()
                .to_owned();
            let (row, column) = (error.line().max(1), error.column().max(1));
            Err(ManifestError::Syntax {
                path: path.to_owned(),
                row,
                column,
                reason,
            })
        }
    }
}

fn listed_files(
    path: &Path,
    object: &Map<String, Value>,
    sources: &Sources<'_>,
) -> Result<Vec<PathBuf>, ManifestError> {
    let key = |key: String, reason: &str| wrong(path, key, reason);
    let list = match object.get("manifest_file_path") {
        Some(Value::Array(list)) => list,
        Some(_) => return Err(key("manifest_file_path".into(), "is not a list of paths")),
        None => return Err(key("manifest_file_path".into(), "is missing")),
    };
    let paths = list.iter().enumerate().map(|(i, value)| match value {
        Value::String(text) if !text.is_empty() => {
            Ok(PathBuf::from(expand(text, sources.variable)))
        }
        _ => Err(key(format!("manifest_file_path[{i}]"), "is not a path")),
    });
    paths.collect()
}

fn modules_of(path: &Path, object: &Map<String, Value>) -> Result<Vec<Module>, ManifestError> {
    let modules = match object.get("module") {
        Some(Value::Array(modules)) => modules,
        Some(_) => return Err(wrong(path, "module".into(), "is not a list of modules")),
        None => {
            let hint = misspelt("module", object.keys().map(String::as_str));
            let reason = format!("is missing, and so is `manifest_file_path`{hint}");
            return Err(wrong(path, "module".into(), &reason));
        }
    };
    modules
        .iter()
        .enumerate()
        .map(|(i, value)| module(path, i, value))
        .collect()
}

fn module(path: &Path, index: usize, value: &Value) -> Result<Module, ManifestError> {
    let Value::Object(object) = value else {
        return Err(wrong(path, format!("module[{index}]"), "is not an object"));
    };
    let keys = Keys {
        path,
        index,
        object,
    };
    keys.choice("exec_type", &[("executable", ())])?;
    let types = [
        ("checker_bundle", ModuleType::CheckerBundle),
        ("report_module", ModuleType::ReportModule),
        ("result_pooling", ModuleType::ResultPooling),
    ];
    let module_type = keys.choice("module_type", &types)?;
    let mode = match object.get("mode") {
        None => Mode::Once,
        Some(_) => keys.choice("mode", &[("bus", Mode::Bus), ("once", Mode::Once)])?,
    };
    Ok(Module {
        name: keys.text("name")?,
        module_type,
        exec_command: keys.text("exec_command")?,
        mode,
        may: keys.may()?,
        shadow: keys.shadow(module_type)?,
        once: keys.once()?,
        extra: extra(object),
        manifest: path.to_owned(),
    })
}

/// The keys of one module, with errors that name them.
struct Keys<'m> {
    path: &'m Path,
    index: usize,
    object: &'m Map<String, Value>,
}

impl Keys<'_> {
    fn text(&self, name: &str) -> Result<String, ManifestError> {
        let reason = match self.object.get(name) {
            Some(Value::String(text)) if !text.trim().is_empty() => return Ok(text.clone()),
            Some(Value::String(_)) => String::from("is empty"),
            Some(_) => String::from("is not a string"),
            None => format!("is missing{}", misspelt(name, others(self.object))),
        };
        Err(self.wrong(name, &reason))
    }

    fn choice<T: Copy>(&self, name: &str, known: &[(&str, T)]) -> Result<T, ManifestError> {
        let value = self.text(name)?;
        if let Some((_, meaning)) = known.iter().find(|(word, _)| *word == value) {
            return Ok(*meaning);
        }
        let words: Vec<&str> = known.iter().map(|(word, _)| *word).collect();
        let hint = did_you_mean(&value, words.iter().copied());
        Err(self.wrong(
            name,
            &format!("is `{value}`, expected {}{hint}", words.join(" or ")),
        ))
    }

    /// Reads the permissions. An unknown key is an error, because it may be a typing error
    /// (`"netwrok"`).
    fn may(&self) -> Result<May, ManifestError> {
        let rights = match self.object.get("may") {
            None => return Ok(May::default()),
            Some(Value::Object(rights)) => rights,
            Some(_) => return Err(self.wrong("may", "is not an object")),
        };
        let mut may = May::default();
        for (key, value) in rights {
            match key.as_str() {
                "read" => may.read = self.paths("may.read", value)?,
                "write" => may.write = self.paths("may.write", value)?,
                "network" => may.network = self.truth("may.network", value)?,
                "programs" => may.programs = self.truth("may.programs", value)?,
                other => {
                    let known = MAY_KEYS.join(", ");
                    let hint = did_you_mean(other, MAY_KEYS.iter().copied());
                    let reason = format!("is not one of {known}{hint}");
                    return Err(self.wrong(&format!("may.{other}"), &reason));
                }
            }
        }
        Ok(may)
    }

    fn shadow(&self, module_type: ModuleType) -> Result<bool, ManifestError> {
        let shadow = match self.object.get("shadow") {
            Some(value) => self.truth("shadow", value)?,
            None => false,
        };
        if shadow && module_type != ModuleType::CheckerBundle {
            return Err(self.wrong("shadow", "is only allowed for checker bundles"));
        }
        Ok(shadow)
    }

    /// Reads the run settings. As in [`Keys::may`], an unknown value is an error.
    fn once(&self) -> Result<Once, ManifestError> {
        let mut once = Once::default();
        if self.object.contains_key("application") {
            once.application = Some(self.text("application")?);
        }
        if self.object.contains_key("working_directory") {
            let path = PathBuf::from(self.text("working_directory")?);
            if !path.is_absolute() {
                return Err(self.wrong("working_directory", "is not an absolute path"));
            }
            once.working_directory = Some(path);
        }
        for (name, value) in self.inner("environment")? {
            let text = value
                .as_str()
                .filter(|_| !name.is_empty() && !name.contains('='));
            let Some(text) = text else {
                return Err(self.wrong(
                    &format!("environment.{name}"),
                    "is not a valid variable name with a string value",
                ));
            };
            once.environment.push((name.clone(), text.to_owned()));
        }
        for (name, value) in self.inner("limits")? {
            let key = format!("limits.{name}");
            if !LIMIT_KEYS.contains(&name.as_str()) {
                let hint = did_you_mean(name, LIMIT_KEYS.iter().copied());
                return Err(self.wrong(
                    &key,
                    &format!("is not one of {}{hint}", LIMIT_KEYS.join(", ")),
                ));
            }
            match value.as_u64().filter(|it| *it > 0) {
                Some(number) => once.limits.push((name.clone(), number)),
                None => return Err(self.wrong(&key, "is not an integer greater than 0")),
            }
        }
        if let Some(warm) = self.object.get("warm") {
            once.cold = !self.truth("warm", warm)?;
        }
        match self.object.get("kinds") {
            None => {}
            Some(Value::Array(kinds)) => {
                let text = |it: &Value| {
                    it.as_str()
                        .filter(|it| KINDS.contains(it))
                        .map(str::to_owned)
                };
                let kinds: Option<Vec<String>> = kinds.iter().map(text).collect();
                let kinds = kinds.filter(|it| !it.is_empty());
                let known = KINDS.join(", ");
                once.kinds = kinds.ok_or_else(|| {
                    self.wrong("kinds", &format!("is not a list with values from {known}"))
                })?;
            }
            Some(_) => return Err(self.wrong("kinds", "is not a list")),
        }
        Ok(once)
    }

    /// Returns the keys of an optional object.
    fn inner(&self, name: &str) -> Result<impl Iterator<Item = (&String, &Value)>, ManifestError> {
        match self.object.get(name) {
            None => Ok(None.into_iter().flatten()),
            Some(Value::Object(object)) => Ok(Some(object).into_iter().flatten()),
            Some(_) => Err(self.wrong(name, "is not an object")),
        }
    }

    fn paths(&self, name: &str, value: &Value) -> Result<Vec<PathBuf>, ManifestError> {
        let Value::Array(list) = value else {
            return Err(self.wrong(name, "is not a list of paths"));
        };
        let path = |(i, value): (usize, &Value)| match value.as_str().map(Path::new) {
            Some(path) if path.is_absolute() => Ok(path.to_owned()),
            _ => Err(self.wrong(&format!("{name}[{i}]"), "is not an absolute path")),
        };
        list.iter().enumerate().map(path).collect()
    }

    fn truth(&self, name: &str, value: &Value) -> Result<bool, ManifestError> {
        let wrong = || self.wrong(name, "is neither true nor false");
        value.as_bool().ok_or_else(wrong)
    }

    fn wrong(&self, name: &str, reason: &str) -> ManifestError {
        wrong(self.path, format!("module[{}].{name}", self.index), reason)
    }
}

/// Returns a hint about a similar key that is written instead of a missing one.
fn misspelt<'k>(name: &str, written: impl Iterator<Item = &'k str>) -> String {
    match closest(name, written) {
        Some(near) => format!("; `{near}` is not a key, did you mean `{name}`?"),
        None => String::new(),
    }
}

/// qcbus's own keys besides `mode`, passed on unchanged.
const OWN_KEYS: [&str; 2] = ["version", "restart"];

const MODULE_KEYS: [&str; 13] = [
    "name",
    "exec_type",
    "module_type",
    "exec_command",
    "mode",
    "may",
    "shadow",
    "application",
    "working_directory",
    "environment",
    "kinds",
    "limits",
    "warm",
];

/// Valid keys of `limits`.
const LIMIT_KEYS: [&str; 3] = ["seconds", "memory_mb", "output_mb"];

/// Valid values of `kinds`: the kinds of files that a module can check.
const KINDS: [&str; 2] = ["xodr", "xosc"];

/// Valid keys of `may`.
const MAY_KEYS: [&str; 4] = ["read", "write", "network", "programs"];

/// Returns the unknown keys of an object, which may be typing errors.
fn others(object: &Map<String, Value>) -> impl Iterator<Item = &str> {
    object
        .keys()
        .map(String::as_str)
        .filter(|key| !MODULE_KEYS.contains(key))
}

fn extra(object: &Map<String, Value>) -> Vec<(String, String)> {
    let own = object
        .iter()
        .filter(|(key, _)| key.starts_with("qcbus") || OWN_KEYS.contains(&key.as_str()));
    let mut extra: Vec<(String, String)> = own
        .map(|(key, value)| match value {
            Value::String(text) => (key.clone(), text.clone()),
            other => (key.clone(), other.to_string()),
        })
        .collect();
    extra.sort();
    extra
}

fn unique(modules: Vec<Module>) -> Result<Vec<Module>, ManifestError> {
    let mut seen: HashMap<(&str, ModuleType), &Path> = HashMap::new();
    for module in &modules {
        let key = (module.name.as_str(), module.module_type);
        if let Some(first) = seen.insert(key, &module.manifest) {
            let reason = format!(
                "`{}` is defined twice, first in {}",
                module.name,
                first.display()
            );
            return Err(wrong(&module.manifest, "name".into(), &reason));
        }
    }
    Ok(modules)
}

fn wrong(path: &Path, key: String, reason: &str) -> ManifestError {
    ManifestError::Key {
        path: path.to_owned(),
        key,
        reason: reason.to_owned(),
    }
}
