//! Findings on a file in a comparable form.

use std::path::{Path, PathBuf};

use qcbus_formats::pool::{CheckerOutcome, Remark};
use qcbus_formats::xqar::{Issue, Level, Location, Locations, Status};

use super::change::normal;
use crate::leaves_open;
use qcbus_sdk::{Loaded, Plan, examine};

/// An issue, independent of the directory of the scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Said {
    /// The checker's id.
    pub checker: String,
    /// Its severity.
    pub level: Level,
    /// Its description.
    pub text: String,
    /// The rows of its locations, the main one first.
    pub rows: Vec<(PathBuf, u64)>,
}

/// Returns all findings on a file below a directory.
///
/// # Errors
/// Returns an error if the file cannot be examined.
pub fn said(plan: &Plan, root: &Path, scenario: &Path) -> Result<Vec<Said>, String> {
    let path = root.join(scenario);
    let folder = path.parent().unwrap_or(root);
    let loaded = Loaded::from_path(&path, folder).map_err(|error| error.to_string())?;
    let outcome = examine(plan, &loaded).map_err(|error| error.to_string())?;
    let bundles = [outcome];
    let remarks = loaded
        .remarks(&bundles)
        .map_err(|error| error.to_string())?;
    let reader = Reader { root, scenario };
    let checkers = bundles[0].checkers.iter();
    let mut all: Vec<Said> = checkers.flat_map(|it| reader.checker(it)).collect();
    all.extend(remarks.iter().filter_map(|it| reader.remark(it)));
    Ok(all)
}

/// Returns the findings that are new. A second occurrence of the same issue is new, too.
pub fn new_ones(before: &[Said], after: Vec<Said>) -> Vec<Said> {
    let mut left: Vec<_> = before.iter().map(Said::key).collect();
    let is_new = |said: &Said| match left.iter().position(|old| *old == said.key()) {
        Some(known) => {
            left.swap_remove(known);
            false
        }
        None => true,
    };
    after.into_iter().filter(is_new).collect()
}

impl Said {
    fn key(&self) -> (&str, Level, Option<&(PathBuf, u64)>, &str) {
        (&self.checker, self.level, self.rows.first(), &self.text)
    }
}

impl std::fmt::Display for Said {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Said { checker, text, .. } = self;
        write!(f, "{} at", self.level.as_str())?;
        for (file, row) in &self.rows {
            write!(f, " {}:{row}", name(file))?;
        }
        write!(f, ": {text} [{checker}]")
    }
}

/// Returns the last component of a path.
pub fn name(file: &Path) -> std::borrow::Cow<'_, str> {
    file.file_name().unwrap_or_default().to_string_lossy()
}

/// Converter of issues to the comparable form.
struct Reader<'r> {
    root: &'r Path,
    scenario: &'r Path,
}

impl Reader<'_> {
    fn checker(&self, checker: &CheckerOutcome) -> Vec<Said> {
        let issues = checker.issues.iter();
        let mut all: Vec<Said> = issues.map(|it| self.issue(&checker.id, it)).collect();
        if checker.status() == Status::Error && !leaves_open(checker.reason()) {
            all.push(Said {
                checker: checker.id.to_string(),
                level: Level::Error,
                text: format!("it failed: {}", checker.reason()),
                rows: Vec::new(),
            });
        }
        all
    }

    fn remark(&self, remark: &Remark) -> Option<Said> {
        let issue = remark.issue.as_ref()?;
        Some(self.issue(&remark.checker, issue))
    }

    fn issue(&self, checker: &str, issue: &Issue) -> Said {
        let root = format!("{}/", self.root.display());
        let locations = issue.locations.iter();
        Said {
            checker: checker.to_owned(),
            level: issue.level,
            text: issue.description.replace(&root, ""),
            rows: locations.flat_map(|it| self.rows(it)).collect(),
        }
    }

    /// Returns the rows of a location. A place in another file also has the row of the reference to
    /// that file.
    fn rows(&self, locations: &Locations) -> Vec<(PathBuf, u64)> {
        let elsewhere = locations.elsewhere.iter().map(|other| {
            let path = normal(Path::new(&other.path));
            let path = path.strip_prefix(self.root).unwrap_or(&path);
            (path.to_owned(), other.row)
        });
        let here = locations.places.iter().filter_map(|place| match place {
            Location::File { row, .. } => Some((self.scenario.to_owned(), *row)),
            _ => None,
        });
        elsewhere.chain(here).collect()
    }
}
