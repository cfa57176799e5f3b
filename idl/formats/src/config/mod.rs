//! Configuration files (`.xml`): bundles, checkers, levels, parameters and reports.
//!
//! [`Config::parse`] reads a file and returns its oddities. [`Config::check`] compares it with the
//! known bundles and reporters. The lookups ([`Config::selects`], [`Config::effective_params`])
//! serve brokers and bundles at run time.

mod check;
mod choice;
mod levels;
mod lookup;
mod parse;
mod value;

use serde::{Deserialize, Serialize};

use crate::xqar::{Level, Param};

pub use check::{Known, KnownBundle, KnownChecker, KnownParam};
pub use choice::{Choice, Names};
pub use levels::Levels;
pub use lookup::{Selected, Selection, published_name, same_bundle, same_reporter};
pub use value::{ParamType, ParamValue};

/// Name of the checker parameter that gives a checker's issues another level.
pub const LEVEL_PARAM: &str = "qcbus.level";

/// Parameter that selects whose levels findings have: [`LEVELS_OF_ASAM`], or those of readers.
pub const LEVELS_PARAM: &str = "qcbus.levels";

/// Value of [`LEVELS_PARAM`]: the levels that the standard demands.
pub const LEVELS_OF_ASAM: &str = "asam";

/// Value of [`LEVELS_PARAM`]: the levels by what readers do with the file.
pub const LEVELS_OF_READERS: &str = "readers";

/// Parameter names for the file to check, the current name first.
pub const INPUT_PARAMS: [&str; 3] = ["InputFile", "XodrFile", "XoscFile"];

/// Global parameter with the search directories for referenced scenarios.
pub const SCENARIO_PATH_PARAM: &str = "qcbus.scenarioPath";

/// A configuration. It is serialisable, so that it can be published in its parsed form.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Config {
    /// Global parameters.
    pub params: Vec<ConfigParam>,
    /// Configured bundles, in order, each `application` once.
    pub bundles: Vec<BundleConfig>,
    /// Configured reports, in order.
    pub reports: Vec<ReportConfig>,
}

/// A configured checker bundle.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct BundleConfig {
    /// The bundle's name or alias, as written.
    pub application: String,
    /// Its parameters.
    pub params: Vec<ConfigParam>,
    /// Its checkers, in order, each id once. If empty, the bundle's default checkers run.
    pub checkers: Vec<CheckerConfig>,
    /// Position in the file.
    pub position: TextPosition,
}

/// A configured checker.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CheckerConfig {
    /// Its identifier.
    pub id: String,
    /// The levels whose issues are kept.
    pub levels: Levels,
    /// Whether `minLevel` and `maxLevel` are in the order of 2023, the smaller number first.
    pub old_order: bool,
    /// The level that all issues get, from the parameter `qcbus.level`.
    pub relevel: Option<Level>,
    /// Its parameters.
    pub params: Vec<ConfigParam>,
    /// Position in the file.
    pub position: TextPosition,
}

/// A configured report.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ReportConfig {
    /// Name as written, such as `TextReport`.
    pub application: String,
    /// Its parameters.
    pub params: Vec<ConfigParam>,
    /// Position in the file.
    pub position: TextPosition,
}

/// A parameter and its position.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ConfigParam {
    /// Name; never empty.
    pub name: String,
    /// Value; empty when the file gives none.
    pub value: String,
    /// Position in the file.
    pub position: TextPosition,
}

/// A row and column of a configuration file, both from 1; columns in characters.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
pub struct TextPosition {
    /// Line.
    pub row: u64,
    /// Column.
    pub column: u64,
}

/// Result of [`Config::parse`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Parsed {
    /// The configuration.
    pub config: Config,
    /// Oddities of the file, in the order of the file.
    pub oddities: Vec<Oddity>,
}

/// An oddity of a configuration that can still be used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Oddity {
    /// [`Level::Warning`], or [`Level::Information`] for outdated spellings.
    pub level: Level,
    /// Line, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// The finding, its meaning, and possibly the intended text.
    pub text: String,
}

/// A configuration that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{row}:{column}: {text}{}", hint_line(.hint))]
pub struct ConfigError {
    /// Line, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// Description of the error.
    pub text: String,
    /// How to fix it; may be empty.
    pub hint: String,
}

fn hint_line(hint: &str) -> String {
    if hint.is_empty() {
        String::new()
    } else {
        format!(" (hint: {hint})")
    }
}

impl ConfigParam {
    /// Returns the parameter without its position.
    pub fn to_param(&self) -> Param {
        Param {
            name: self.name.clone(),
            value: self.value.clone(),
        }
    }
}

impl Oddity {
    /// Formats the oddity as a line: `FILE:ROW:COLUMN: LEVEL: TEXT`.
    pub fn line(&self, file: &std::path::Path) -> String {
        let Oddity {
            level,
            row,
            column,
            text,
        } = self;
        format!(
            "{}:{row}:{column}: {}: {text}",
            file.display(),
            level.as_str()
        )
    }

    pub(crate) fn warning(position: TextPosition, text: String) -> Oddity {
        Oddity {
            level: Level::Warning,
            row: position.row,
            column: position.column,
            text,
        }
    }

    pub(crate) fn information(position: TextPosition, text: String) -> Oddity {
        Oddity {
            level: Level::Information,
            row: position.row,
            column: position.column,
            text,
        }
    }
}
