//! Mirror of a directory with some changed files. All others are links.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::Changed;

/// A temporary directory in which every file is a link to the original.
pub struct Overlay {
    source: PathBuf,
    copy: TempDir,
}

impl Overlay {
    /// Mirrors a directory.
    ///
    /// # Errors
    /// Returns an error if it cannot be read or the links cannot be made.
    pub fn of(source: &Path) -> std::io::Result<Overlay> {
        let overlay = Overlay {
            source: source.canonicalize()?,
            copy: TempDir::new()?,
        };
        overlay.mirror(Path::new(""))?;
        Ok(overlay)
    }

    /// Returns the path of the mirror.
    pub fn root(&self) -> &Path {
        self.copy.path()
    }

    /// Runs an action while files are changed.
    ///
    /// # Errors
    /// Returns an error if a file cannot be changed or restored.
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
        // The link is removed before writing; otherwise the write would change the original.
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
