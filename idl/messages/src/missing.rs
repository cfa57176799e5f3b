//! What a file refers to and could not be had.

use std::fmt;

use qcbus_formats::xqar::Level;
use serde::{Deserialize, Serialize};

use crate::DocumentRole;

/// A file that the root refers to and that could not be had, or is there and of no use.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingDocument {
    /// What it would have been.
    pub role: DocumentRole,
    /// The reference as written.
    pub reference: String,
    /// Where it was looked for; empty when it could not be looked for anywhere.
    pub path: String,
    /// Why it could not be had.
    pub why: Absence,
    /// How much it weighs: an error leads certainly nowhere, a warning leaves open what it leads to,
    /// an information is no business of the file.
    pub level: Level,
    /// Byte offset of the element in the root's image that leads here, perhaps through other
    /// documents.
    pub referred_at: u32,
    /// The reference itself, where another document than the root has it.
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

/// Why a file that is referred to could not be had.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Absence {
    /// There is nothing of that name.
    NotThere,
    /// It is a directory.
    Directory,
    /// It is a device, a pipe or a socket.
    NotAFile,
    /// The system refused, or the bus did.
    Unreadable {
        /// What was said.
        why: String,
    },
    /// It lies on another machine, and nothing is fetched.
    Remote,
    /// It is larger than what is read.
    TooLarge {
        /// What it has and what is allowed.
        why: String,
    },
    /// The reference is empty.
    EmptyPath,
    /// The reference holds a parameter without a plain default.
    Parameter {
        /// Its name, without `$`.
        name: String,
    },
    /// The reference is an expression, which is known only when the scenario runs.
    Expression,
    /// More documents or catalogs belong to the file than are read.
    TooMany {
        /// How many are read.
        most: u64,
    },
    /// No file is meant, but a map that the simulator knows by this name.
    SimulatorMap,
    /// It leads out of the archive that refers to it.
    Escapes,
    /// What it is called is neither a scenario nor an archive of one.
    NotAScenario,
    /// Scenarios refer to scenarios more deeply than is followed.
    TooDeep {
        /// How deeply they are followed.
        most: u32,
    },
    /// A modular scenario of which no plain one could be made.
    NotExpanded {
        /// What is in the way.
        why: String,
    },
    /// It is there and read, and cannot be relied on: not well-formed, or without a part of it.
    Broken {
        /// The file with the first fault: itself, or one that it includes.
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
    /// Reads on after the name of the file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Absence::NotThere => f.write_str("is not there"),
            Absence::Directory => f.write_str("is a directory, not a file"),
            Absence::NotAFile => f.write_str("is a device, pipe or socket, not a file"),
            Absence::Unreadable { why } => write!(f, "cannot be read: {why}"),
            Absence::Remote => {
                f.write_str("lies elsewhere, and nothing is fetched from the network")
            }
            Absence::TooLarge { why } => write!(f, "is too large: {why}"),
            Absence::EmptyPath => f.write_str("is an empty path, which names no file"),
            Absence::Parameter { name } => write!(
                f,
                "cannot be looked for: the parameter `${name}` has no plain default"
            ),
            Absence::Expression => f.write_str(
                "cannot be looked for: the path is an expression, which is known only when it runs",
            ),
            Absence::TooMany { most } => {
                write!(
                    f,
                    "is not read: more than {most} documents belong to the file"
                )
            }
            Absence::SimulatorMap => {
                f.write_str("is the name of a map that the simulator knows, not of a file")
            }
            Absence::Escapes => f.write_str(
                "is no name for what lies in an archive or in a directory of the search path: such names are relative, parted by `/` and without `..`",
            ),
            Absence::NotAScenario => f.write_str(
                "is not looked for: the name of a scenario ends in `.xosc`, that of an archive in `.mosc`",
            ),
            Absence::TooDeep { most } => {
                write!(f, "is not read: scenarios refer to scenarios more than {most} deep")
            }
            Absence::NotExpanded { why } => write!(f, "cannot be expanded: {why}"),
            Absence::Broken {
                path,
                row,
                column,
                text,
            } => write!(f, "cannot be relied on: {path}:{row}:{column}: {text}"),
        }
    }
}
