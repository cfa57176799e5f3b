//! A producer's directory with a few other files in it: links to all that is the same.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::encode::{text, with_text};
use super::scan::Scan;
use super::table::{Change, Edit, Entry, Target};

/// A directory of its own in which every file is a link into the producer's.
pub struct Overlay {
    source: PathBuf,
    copy: TempDir,
}

/// The files that an entry changes, below the producer's directory; none: removed.
pub type Changed = BTreeMap<PathBuf, Option<Vec<u8>>>;

impl Overlay {
    pub fn of(source: &Path) -> std::io::Result<Overlay> {
        let overlay = Overlay {
            source: source.canonicalize()?,
            copy: TempDir::new()?,
        };
        overlay.mirror(Path::new(""))?;
        Ok(overlay)
    }

    /// Where the files are.
    pub fn root(&self) -> &Path {
        self.copy.path()
    }

    /// Does something while files are changed.
    pub fn with<T>(&self, changed: &Changed, act: impl FnOnce(&Path) -> T) -> std::io::Result<T> {
        for (path, content) in changed {
            self.put(path, content.as_deref())?;
        }
        let done = act(self.root());
        for path in changed.keys() {
            self.restore(path)?;
        }
        Ok(done)
    }

    fn mirror(&self, folder: &Path) -> std::io::Result<()> {
        for entry in std::fs::read_dir(self.source.join(folder))? {
            let path = folder.join(entry?.file_name());
            if self.source.join(&path).is_dir() {
                std::fs::create_dir(self.root().join(&path))?;
                self.mirror(&path)?;
            } else {
                self.link(&path)?;
            }
        }
        Ok(())
    }

    fn link(&self, path: &Path) -> std::io::Result<()> {
        std::os::unix::fs::symlink(self.source.join(path), self.root().join(path))
    }

    fn put(&self, path: &Path, content: Option<&[u8]>) -> std::io::Result<()> {
        let copy = self.root().join(path);
        // Never through a link: the file at its other end is not ours.
        if self.source.join(path).exists() {
            std::fs::remove_file(&copy)?;
        }
        if let Some(content) = content {
            let folder = copy.parent().unwrap_or(self.root());
            std::fs::create_dir_all(folder)?;
            std::fs::write(copy, content)?;
        }
        Ok(())
    }

    fn restore(&self, path: &Path) -> std::io::Result<()> {
        let copy = self.root().join(path);
        if copy.exists() {
            std::fs::remove_file(&copy)?;
        }
        if self.source.join(path).exists() {
            return self.link(path);
        }
        let above = path.ancestors().skip(1);
        for made in above.take_while(|folder| !self.source.join(folder).exists()) {
            std::fs::remove_dir(self.root().join(made))?;
        }
        Ok(())
    }
}

/// Rows of one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Rows {
    Any,
    These(BTreeSet<u64>),
}

impl Rows {
    pub fn has(&self, row: u64) -> bool {
        match self {
            Rows::Any => true,
            Rows::These(rows) => rows.contains(&row),
        }
    }
}

/// Rows by file, below the producer's directory.
pub type Spots = BTreeMap<PathBuf, Rows>;

/// Applies an entry's edits: what becomes of the files, and where it must be found.
pub fn apply(entry: &Entry, source: &Path) -> Result<(Changed, Spots), String> {
    let (mut changed, mut edited) = (Changed::new(), Spots::new());
    for edit in &entry.edits {
        let rows = edit.apply(source, &mut changed)?;
        add(&mut edited, &edit.file, Rows::These(rows));
    }
    if entry.at.is_empty() {
        return Ok((changed, edited));
    }
    let mut spots = Spots::new();
    for target in &entry.at {
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
    fn apply(&self, source: &Path, changed: &mut Changed) -> Result<BTreeSet<u64>, String> {
        let top = BTreeSet::from([1]);
        let (new, rows) = match &self.change {
            Change::Write(_) if source.join(&self.file).exists() => {
                return Err(format!("{} is there already", self.file.display()));
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
