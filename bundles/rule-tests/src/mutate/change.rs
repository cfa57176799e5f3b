//! Edits of files and the rows where their effect must be visible.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use super::edit::Action;
use super::encode::{Storage, text, with_text};
use super::scan::Scan;
use super::select::Selector;

/// Contents of changed files by path relative to the directory; `None` means removed.
pub type Changed = BTreeMap<PathBuf, Option<Vec<u8>>>;

/// An element of a file, or the whole file.
#[derive(Debug)]
pub struct Target {
    /// `None` means anywhere in the file.
    pub selector: Option<Selector>,
    /// Path relative to the directory.
    pub file: PathBuf,
}

/// A change of a file.
#[derive(Debug)]
pub struct Edit {
    change: Change,
    /// Path relative to the directory.
    pub file: PathBuf,
}

#[derive(Debug)]
enum Change {
    Element(Selector, Action),
    Storage(Storage),
    Write(String),
    Remove,
}

/// Rows of one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Rows {
    /// All of them.
    Any,
    /// Some rows.
    These(BTreeSet<u64>),
}

impl Rows {
    /// Checks whether a row is included.
    pub fn has(&self, row: u64) -> bool {
        match self {
            Rows::Any => true,
            Rows::These(rows) => rows.contains(&row),
        }
    }
}

/// Rows by file, relative to the directory.
pub type Spots = BTreeMap<PathBuf, Rows>;

/// Applies edits in order. Returns the changed files and the rows where the effect must be found.
/// These are the targets, or the edited rows if there are no targets.
///
/// # Errors
/// Returns an error for an edit that cannot be made.
pub fn apply(edits: &[Edit], at: &[Target], source: &Path) -> Result<(Changed, Spots), String> {
    let (mut changed, mut edited) = (Changed::new(), Spots::new());
    for edit in edits {
        let rows = edit.apply(source, &mut changed)?;
        add(&mut edited, &edit.file, Rows::These(rows));
    }
    if at.is_empty() {
        return Ok((changed, edited));
    }
    let mut spots = Spots::new();
    for target in at {
        add(&mut spots, &target.file, target.rows(source, &changed)?);
    }
    Ok((changed, spots))
}

fn add(spots: &mut Spots, file: &Path, rows: Rows) {
    match (spots.get_mut(file), rows) {
        (Some(Rows::These(all)), Rows::These(more)) => all.extend(more),
        (Some(Rows::Any), _) => {}
        (_, rows) => _ = spots.insert(file.to_owned(), rows),
    }
}

impl Edit {
    /// Parses `SELECTOR | EDIT`. The words are described in `bundles/xosc/tests/rules/seeded/README.md`.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn parse(line: &str, file: PathBuf) -> Result<Edit, String> {
        Edit::by(line, file, "name")
    }

    /// Parses an edit; `#value` in a selector means the attribute `key`.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn by(line: &str, file: PathBuf, key: &str) -> Result<Edit, String> {
        let (selector, action) = line
            .split_once(" | ")
            .ok_or_else(|| format!("expected an edit or a place, found: {line}"))?;
        let change = match (selector.trim(), action.trim()) {
            (".", "remove") => Change::Remove,
            (".", action) => match action.strip_prefix("write ") {
                Some(text) => Change::Write(text.to_owned()),
                None => Change::Storage(Storage::parse(action)?),
            },
            (selector, action) => {
                Change::Element(Selector::by(selector, key)?, Action::parse(action)?)
            }
        };
        Ok(Edit { change, file })
    }

    fn apply(&self, source: &Path, changed: &mut Changed) -> Result<BTreeSet<u64>, String> {
        let top = BTreeSet::from([1]);
        let (new, rows) = match &self.change {
            Change::Write(_) if source.join(&self.file).exists() => {
                return Err(format!("{} already exists", self.file.display()));
            }
            Change::Write(text) => (Some(text.clone().into_bytes()), top),
            Change::Remove => {
                content(source, changed, &self.file)?;
                (None, top)
            }
            Change::Storage(storage) => {
                let bytes = content(source, changed, &self.file)?;
                (Some(storage.apply(&bytes)?), top)
            }
            Change::Element(selector, action) => {
                let bytes = content(source, changed, &self.file)?;
                let (edited, rows) = action.apply(selector, text(&bytes)?)?;
                (Some(with_text(&bytes, &edited)), rows)
            }
        };
        changed.insert(self.file.clone(), new);
        Ok(rows)
    }
}

impl Target {
    /// Parses a selector, or `.` for the whole file.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn parse(selector: &str, file: PathBuf) -> Result<Target, String> {
        Target::by(selector, file, "name")
    }

    /// Parses a target; `#value` in a selector means the attribute `key`.
    ///
    /// # Errors
    /// Returns an error for text that cannot be parsed.
    pub fn by(selector: &str, file: PathBuf, key: &str) -> Result<Target, String> {
        let selector = (selector != ".").then(|| Selector::by(selector, key));
        let selector = selector.transpose()?;
        Ok(Target { selector, file })
    }

    fn rows(&self, source: &Path, changed: &Changed) -> Result<Rows, String> {
        let Some(selector) = &self.selector else {
            return Ok(Rows::Any);
        };
        let bytes = content(source, changed, &self.file)?;
        let scan = Scan::of(text(&bytes)?)?;
        let id = selector.one(&scan)?;
        Ok(Rows::These(scan.rows(id).collect()))
    }
}

fn content(source: &Path, changed: &Changed, file: &Path) -> Result<Vec<u8>, String> {
    match changed.get(file) {
        Some(content) => {
            let content = content.clone();
            content.ok_or_else(|| format!("{} was removed", file.display()))
        }
        None => {
            std::fs::read(source.join(file)).map_err(|error| format!("{}: {error}", file.display()))
        }
    }
}

/// Resolves a path that starts at the directory of a file. Both are below the mirrored directory.
///
/// # Errors
/// Returns an error if the path leads out of that directory.
pub fn beside(file: &Path, path: &str) -> Result<PathBuf, String> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let path = normal(&folder.join(path));
    if path.starts_with("..") {
        return Err(format!(
            "the path leads out of the directory: {}",
            path.display()
        ));
    }
    Ok(path)
}

/// Returns a path without `.` and, as far as possible, without `..`.
pub fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if normal.file_name().is_some() => _ = normal.pop(),
            _ => normal.push(component),
        }
    }
    normal
}
