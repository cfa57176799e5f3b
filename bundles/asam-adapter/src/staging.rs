//! Copies the documents of a job to a private directory and keeps their relative paths.

use std::fs::File;
use std::io::{self, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use sha2::{Digest as _, Sha256};

use crate::look::Look;
use crate::messages::{Bytes, Document, MOST};

/// Documents in a private directory.
pub(crate) struct Staged {
    /// Directory that replaces `real`.
    pub directory: PathBuf,
    /// Original directory of all documents.
    pub real: PathBuf,
    files: Vec<Copied>,
}

/// A copied file.
struct Copied {
    path: PathBuf,
    look: Look,
    digest: [u8; 32],
}

impl Staged {
    /// Writes the files below a directory. `body` has the bytes of files in the message.
    ///
    /// # Errors
    /// System errors, and an error if a file has changed on disk.
    pub fn write(files: &[Document], mut body: &[u8], directory: &Path) -> io::Result<Staged> {
        let real = common(files)?;
        let mut staged = Staged {
            directory: directory.to_path_buf(),
            real,
            files: Vec::new(),
        };
        for file in files {
            let read;
            let bytes = match file.bytes {
                Bytes::Here(length) => {
                    let length = usize::try_from(length).unwrap_or(usize::MAX);
                    let (bytes, rest) = body
                        .split_at_checked(length)
                        .ok_or(io::ErrorKind::UnexpectedEof)?;
                    body = rest;
                    bytes
                }
                Bytes::OnDisk(digest) => {
                    read = foreign::read(&file.path, MOST)?;
                    if <[u8; 32]>::from(Sha256::digest(&read)) != digest {
                        let why = format!("{} has changed in the meantime", file.path.display());
                        return Err(io::Error::other(why));
                    }
                    &read
                }
            };
            staged.add(file, bytes)?;
        }
        Ok(staged)
    }

    fn add(&mut self, file: &Document, bytes: &[u8]) -> io::Result<()> {
        let inside = file.path.strip_prefix(&self.real);
        let path = self.directory.join(inside.map_err(io::Error::other)?);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        let mut out = File::create_new(&path)?;
        out.write_all(bytes)?;
        // The file is read-only to prevent accidental writes.
        out.set_permissions(std::fs::Permissions::from_mode(0o400))?;
        self.files.push(Copied {
            look: Look::of(&out.metadata()?),
            digest: Sha256::digest(bytes).into(),
            path,
        });
        Ok(())
    }

    /// Returns the file to check.
    pub fn input(&self) -> &Path {
        self.files.first().map_or(&self.directory, |it| &it.path)
    }

    /// Returns a document that has changed since it was written. The findings are then about
    /// another text.
    pub fn changed(&self) -> Option<PathBuf> {
        let changed = self.files.iter().find(|it| it.has_changed())?;
        let inside = changed.path.strip_prefix(&self.directory).ok()?;
        Some(self.real.join(inside))
    }
}

impl Copied {
    fn has_changed(&self) -> bool {
        if Look::at(&self.path) == Some(self.look) {
            return false;
        }
        // Maybe only the permissions or the hard links have changed.
        let read = foreign::read(&self.path, MOST);
        read.map_or(true, |it| {
            <[u8; 32]>::from(Sha256::digest(&it)) != self.digest
        })
    }
}

/// Returns the deepest directory that contains all files.
fn common(files: &[Document]) -> io::Result<PathBuf> {
    let mut parents = files.iter().filter_map(|it| it.path.parent());
    let first = parents.next().ok_or(io::ErrorKind::InvalidInput)?;
    let mut common = first.to_path_buf();
    for parent in parents {
        while !parent.starts_with(&common) {
            common.pop();
        }
    }
    Ok(common)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn here(path: &str, length: u64) -> Document {
        Document {
            path: path.into(),
            bytes: Bytes::Here(length),
            packed: None,
        }
    }

    #[test]
    fn staged_files_keep_relative_paths_and_report_changes() {
        let dir = tempfile::tempdir().unwrap();
        let files = [here("/a/b/c/x.xosc", 2), here("/a/maps/m.xodr", 3)];
        let staged = Staged::write(&files, b"xxmmm", dir.path()).unwrap();
        assert_eq!(staged.real, Path::new("/a"));
        assert_eq!(staged.input(), dir.path().join("b/c/x.xosc"));
        let map = std::fs::read(dir.path().join("b/c/../../maps/m.xodr")).unwrap();
        assert_eq!(map, b"mmm");
        assert_eq!(staged.changed(), None);
        let input = staged.input().to_path_buf();
        std::fs::set_permissions(&input, std::fs::Permissions::from_mode(0o600)).unwrap();
        assert_eq!(staged.changed(), None, "the content is unchanged");
        std::fs::write(&input, "yy").unwrap();
        assert_eq!(staged.changed(), Some("/a/b/c/x.xosc".into()));
    }

    #[test]
    fn file_on_disk_is_staged_only_with_expected_digest() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodrz");
        std::fs::write(&path, "packed").unwrap();
        let seen = |text: &str| Document {
            path: path.clone(),
            bytes: Bytes::OnDisk(Sha256::digest(text).into()),
            packed: None,
        };
        let place = |name: &str| {
            let place = dir.path().join(name);
            std::fs::create_dir(&place).unwrap();
            place
        };
        let staged = Staged::write(&[seen("packed")], b"", &place("1")).unwrap();
        assert_eq!(std::fs::read(staged.input()).unwrap(), b"packed");
        assert!(Staged::write(&[seen("other")], b"", &place("2")).is_err());
    }
}
