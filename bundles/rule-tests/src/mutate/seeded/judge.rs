//! Evaluation of the findings on an edited file.

use std::path::PathBuf;

use crate::mutate::{Said, Spots};
use qcbus_sdk::Level;

use super::table::Entry;

/// Result of an entry.
#[derive(Debug)]
pub struct Trial<'e> {
    pub entry: &'e Entry,
    pub found: Found,
    /// Rows where the fault must be found.
    pub spots: Spots,
    /// Findings that did not exist before the edit.
    pub new: Vec<Said>,
    /// Whether one of them is an error at the expected rows.
    pub has_error: bool,
    /// Number of errors among them without a location at the expected rows.
    pub further: usize,
}

/// Whether and where a fault is found. A harmless variant is tried likewise, but must not be found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// The main location of an issue is at the expected rows.
    Here,
    /// A further location of an issue is at the expected rows.
    Beside,
    /// An issue is at the expected rows, but its level is too low.
    Weakly,
    /// An issue is only at other rows.
    Elsewhere,
    Not,
}

impl Found {
    pub fn is_enough(self) -> bool {
        matches!(self, Found::Here | Found::Beside)
    }

    /// Checks whether an issue is at the expected rows.
    pub fn is_there(self) -> bool {
        self.is_enough() || self == Found::Weakly
    }
}

impl Trial<'_> {
    /// Returns the new issues of a level.
    pub fn new_at(&self, level: Level) -> impl Iterator<Item = &Said> {
        self.new.iter().filter(move |said| said.level == level)
    }

    /// Checks whether a harmless variant is rejected.
    pub fn is_alarm(&self) -> bool {
        self.new_at(Level::Error).next().is_some()
    }
}

/// Evaluates the new findings after an edit.
pub fn judge(entry: &Entry, spots: Spots, new: Vec<Said>) -> Trial<'_> {
    let least = entry.level.unwrap_or(Level::Error);
    let is_at = |(file, row): &(PathBuf, u64)| spots.get(file).is_some_and(|rows| rows.has(*row));
    let here = |said: &Said| said.rows.first().is_some_and(is_at);
    let near = |said: &Said| said.rows.iter().any(is_at);
    // A smaller level is worse.
    let mut due = new.iter().filter(|said| said.level <= least);
    let found = if due.clone().any(here) {
        Found::Here
    } else if due.clone().any(near) {
        Found::Beside
    } else if new.iter().any(near) {
        Found::Weakly
    } else if due.next().is_some() {
        Found::Elsewhere
    } else {
        Found::Not
    };
    let has_error = new
        .iter()
        .any(|said| said.level == Level::Error && near(said));
    let far = |said: &&Said| said.level == Level::Error && !near(said);
    let further = new.iter().filter(far).count();
    Trial {
        entry,
        found,
        spots,
        new,
        has_error,
        further,
    }
}
