//! Files that a file refers to and that are missing.

use std::fmt;

use qcbus_formats::xqar::Level;
use serde::{Deserialize, Serialize};

use crate::DocumentRole;

/// A file that the root refers to and that is missing or cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingDocument {
    /// Its expected role.
    pub role: DocumentRole,
    /// The reference as written.
    pub reference: String,
    /// The path where it was expected; empty when the reference gives no path.
    pub path: String,
    /// The reason why it is missing.
    pub why: Absence,
    /// Severity. Error: the reference certainly leads nowhere. Warning: its target is unknown.
    /// Information: it is no problem of the file.
    pub level: Level,
    /// Byte offset of the element in the root's image that leads here, directly or through other
    /// documents.
    pub referred_at: u32,
    /// The reference itself, if it is in another document than the root.
    pub within: Option<Within>,
}

/// A place in another document than the root.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Within {
    /// The document's path.
    pub path: String,
    /// Line, from 1.
    pub row: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

/// Reason why a referenced file is missing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Absence {
    /// No file of this name exists.
    NotThere,
    /// It is a directory.
    Directory,
    /// It is a device, a pipe or a socket.
    NotAFile,
    /// The system or the bus refused access.
    Unreadable {
        /// The error message.
        why: String,
    },
    /// It is on another machine. Files are not fetched over a network.
    Remote,
    /// It is larger than the limit.
    TooLarge {
        /// Its size and the limit.
        why: String,
    },
    /// The reference is empty.
    EmptyPath,
    /// The reference contains a parameter without a plain default.
    Parameter {
        /// Name of the parameter, without `$`.
        name: String,
    },
    /// The reference is an expression, and its value is known only when the scenario runs.
    Expression,
    /// The file needs more documents or catalogs than the limit.
    TooMany {
        /// The limit.
        most: u64,
    },
    /// The reference means a map that the simulator knows by this name, not a file.
    SimulatorMap,
    /// The reference leads out of the archive that contains it, or into another archive.
    Escapes,
    /// Its name has neither the suffix of a scenario nor that of an archive of one.
    NotAScenario,
    /// Scenarios refer to scenarios more deeply than the limit.
    TooDeep {
        /// The maximum depth.
        most: u32,
    },
    /// A modular scenario that cannot be expanded to a plain one.
    NotExpanded {
        /// The reason.
        why: String,
    },
    /// It was read but is not reliable: it is not well-formed, or a part of it is missing.
    Broken {
        /// The file with the first fault: the document itself, or a file that it includes.
        path: String,
        /// Line of the fault, from 1.
        row: u32,
        /// Column of the fault in characters, from 1.
        column: u32,
        /// The fault.
        text: String,
    },
}

impl fmt::Display for Absence {
    /// Writes text that continues a sentence after the name of the file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Absence::NotThere => f.write_str("does not exist"),
            Absence::Directory => f.write_str("is a directory, not a file"),
            Absence::NotAFile => f.write_str("is a device, pipe or socket, not a file"),
            Absence::Unreadable { why } => write!(f, "cannot be read: {why}"),
            Absence::Remote => {
                f.write_str("is not a local file, and nothing is fetched from the network")
            }
            Absence::TooLarge { why } => write!(f, "is too large: {why}"),
            Absence::EmptyPath => f.write_str("is an empty path, which names no file"),
            Absence::Parameter { name } => write!(
                f,
                "cannot be resolved: the parameter `${name}` has no plain default"
            ),
            Absence::Expression => f.write_str(
                "cannot be resolved: the path is an expression, which is known only at run time",
            ),
            Absence::TooMany { most } => {
                write!(
                    f,
                    "is not read: more than {most} documents belong to the file"
                )
            }
            Absence::SimulatorMap => {
                f.write_str("is the name of a map of the simulator, not of a file")
            }
            Absence::Escapes => f.write_str(
                "is not a valid name in an archive or in a directory of the search path: such names are \
                 relative, separated by `/` and without `..`",
            ),
            Absence::NotAScenario => f.write_str(
                "is not searched: the name of a scenario must end in `.xosc`, that of an archive in `.mosc`",
            ),
            Absence::TooDeep { most } => {
                write!(f, "is not read: scenario references are nested more than {most} deep")
            }
            Absence::NotExpanded { why } => write!(f, "cannot be expanded: {why}"),
            Absence::Broken {
                path,
                row,
                column,
                text,
            } => write!(f, "is not reliable: {path}:{row}:{column}: {text}"),
        }
    }
}
