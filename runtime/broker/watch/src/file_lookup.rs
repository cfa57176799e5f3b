//! Lookup of a path: a file, possibly behind a symbolic link, or the reason why no file is visible.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_types::{Stamp, leads_upwards};
use rustix::fs::{CWD, Mode, OFlags, ResolveFlags};
use rustix::io::Errno;

use super::ignore::hidden_above;
use crate::stamp::from_metadata;

/// Result of the lookup of a path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FileLookup {
    /// A regular file, at the path or behind a symbolic link.
    File(Stamp),
    /// A directory to scan, not a link to one.
    Directory,
    /// A symbolic link to a directory that is scanned at its own path.
    Known,
    /// The path does not exist.
    Nothing,
    /// An entry that is no file and leads to none, with its kind.
    NoFile(NoFile),
    /// The path exists or may exist, but is inaccessible. Contains the error of the system.
    Hidden(String),
}

/// Kind of an entry that is no file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoFile {
    /// A symbolic link to a missing target.
    Dangling(PathBuf),
    /// A symbolic link that leads back to itself.
    Loop,
    /// A symbolic link to a directory that is not scanned.
    Outside(PathBuf),
    /// A pipe, a socket or a device.
    Special,
}

impl NoFile {
    /// Checks whether the entry is reported whatever its name is, because it may hide a whole
    /// directory. Any other entry is reported only if it has the name of a checkable file.
    pub fn hides_more(&self) -> bool {
        matches!(self, NoFile::Loop | NoFile::Outside(_))
    }
}

impl std::fmt::Display for NoFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = qcbus_messages::path_text::to_text;
        match self {
            NoFile::Dangling(target) => {
                let target = text(target);
                write!(f, "it is a symbolic link to {target}, which does not exist")
            }
            NoFile::Loop => write!(f, "it is a symbolic link that leads back to itself"),
            NoFile::Outside(target) => {
                let target = text(target);
                write!(
                    f,
                    "it is a symbolic link to the directory {target}, and such links are not followed; name that \
                     directory as well to have it scanned"
                )
            }
            NoFile::Special => write!(f, "it is a pipe, a socket or a device, not a file"),
        }
    }
}

/// Looks up a path. `roots` are the scanned directories, without symbolic links. A path behind a
/// symbolic link to a directory counts as missing.
pub fn look_at(path: &Path, roots: &[PathBuf]) -> FileLookup {
    let looked = foreign::access(path, || Ok(look(path, roots)));
    looked.unwrap_or_else(|error| FileLookup::Hidden(format!("cannot access it: {error}")))
}

fn look(path: &Path, roots: &[PathBuf]) -> FileLookup {
    if is_behind_a_link(path, roots) {
        return match std::fs::metadata(path) {
            // Behind a link loop it is unknown whether the path still exists.
            Err(error) if !is_absent(&error) => {
                FileLookup::Hidden(format!("cannot access it: {error}"))
            }
            _ => FileLookup::Nothing,
        };
    }
    match std::fs::symlink_metadata(path) {
        Ok(data) if data.is_file() => FileLookup::File(from_metadata(&data)),
        Ok(data) if data.is_dir() => FileLookup::Directory,
        Ok(data) if data.is_symlink() => behind(path, roots),
        Ok(_) => FileLookup::NoFile(NoFile::Special),
        Err(error) if is_absent(&error) => FileLookup::Nothing,
        Err(error) => FileLookup::Hidden(format!("cannot access it: {error}")),
    }
}

fn behind(link: &Path, roots: &[PathBuf]) -> FileLookup {
    match std::fs::metadata(link) {
        Ok(data) if data.is_file() => FileLookup::File(from_metadata(&data)),
        Ok(data) if data.is_dir() => match std::fs::canonicalize(link) {
            Ok(real) if is_looked_into(roots, &real) => FileLookup::Known,
            Ok(real) => FileLookup::NoFile(NoFile::Outside(real)),
            Err(error) => FileLookup::Hidden(format!("cannot follow this link: {error}")),
        },
        Ok(_) => FileLookup::NoFile(NoFile::Special),
        Err(error) if is_absent(&error) => {
            // The link may be gone meanwhile. Its target is then unknown.
            let target = std::fs::read_link(link).unwrap_or_default();
            FileLookup::NoFile(NoFile::Dangling(target))
        }
        Err(error) if error.raw_os_error() == Some(libc::ELOOP) => FileLookup::NoFile(NoFile::Loop),
        Err(error) => FileLookup::Hidden(format!("cannot follow this link: {error}")),
    }
}

/// Checks whether a directory is scanned at its own path. Directories of tools count as scanned.
fn is_looked_into(roots: &[PathBuf], directory: &Path) -> bool {
    let is_inside = roots.iter().any(|root| directory.starts_with(root));
    is_inside && hidden_above(roots, directory).is_none()
}

/// Checks whether a path below a root leads through a symbolic link to a directory, or contains
/// `..`. A `..` only occurs behind a link. Such a path is not scanned under this name.
pub fn is_behind_a_link(path: &Path, roots: &[PathBuf]) -> bool {
    if leads_upwards(path) {
        return true;
    }
    let Some(directory) = path.parent() else {
        return false;
    };
    let mut inside = roots
        .iter()
        .filter(|root| directory.starts_with(root))
        .peekable();
    inside.peek().is_some()
        && inside.all(|root| {
            let opened = open_below(root, directory, OFlags::PATH);
            opened.is_err_and(|error| error.raw_os_error() == Some(libc::ELOOP))
        })
}

/// Opens a directory for reading, if the path from its root contains no symbolic link.
///
/// # Errors
/// The error of the system. `ELOOP` if the path contains a link.
pub fn open_directory(directory: &Path, roots: &[PathBuf]) -> io::Result<OwnedFd> {
    let inside = roots.iter().filter(|root| directory.starts_with(root));
    // The nearest root is used, because fewer links can lie between.
    match inside.max_by_key(|root| root.as_os_str().len()) {
        Some(root) => open_below(root, directory, OFlags::RDONLY),
        None => open_below(directory, directory, OFlags::RDONLY),
    }
}

fn open_below(root: &Path, directory: &Path, how: OFlags) -> io::Result<OwnedFd> {
    let how = how | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let below = directory.strip_prefix(root).unwrap_or(directory);
    if below.as_os_str().is_empty() {
        return Ok(rustix::fs::openat(CWD, root, how, Mode::empty())?);
    }
    let top = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let top = rustix::fs::openat(CWD, root, top, Mode::empty())?;
    let no_links = ResolveFlags::NO_SYMLINKS | ResolveFlags::NO_MAGICLINKS;
    match rustix::fs::openat2(&top, below, how, Mode::empty(), no_links) {
        // The kernel is older than 5.6, or the container does not support this call.
        Err(Errno::NOSYS | Errno::PERM) if has_link(root, directory) => Err(Errno::LOOP.into()),
        Err(Errno::NOSYS | Errno::PERM) => Ok(rustix::fs::openat(
            &top,
            below,
            how | OFlags::NOFOLLOW,
            Mode::empty(),
        )?),
        opened => Ok(opened?),
    }
}

fn has_link(root: &Path, directory: &Path) -> bool {
    let below = directory.ancestors().take_while(|it| *it != root);
    let mut below = below.filter(|it| it.starts_with(root));
    below.any(Path::is_symlink)
}

fn is_absent(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
    )
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn link_is_classified_by_its_target() {
        let (inside, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let root = inside.path().canonicalize().unwrap();
        let outside = outside.path().canonicalize().unwrap();
        let roots = [root.clone()];
        std::fs::write(outside.join("a.xodr"), "<OpenDRIVE/>").unwrap();
        std::fs::create_dir(root.join("maps")).unwrap();
        let link = |name: &str, target: &Path| {
            let path = root.join(name);
            symlink(target, &path).unwrap();
            look_at(&path, &roots)
        };
        let file = look_at(&outside.join("a.xodr"), &roots);
        assert!(matches!(file, FileLookup::File(_)));
        assert_eq!(link("a.xodr", &outside.join("a.xodr")), file);
        assert_eq!(link("twice.xodr", &root.join("a.xodr")), file);
        assert_eq!(link("inner", &root.join("maps")), FileLookup::Known);
        let outer = FileLookup::NoFile(NoFile::Outside(outside.clone()));
        assert_eq!(link("outer", &outside), outer);
        let above = root.parent().unwrap();
        let up = FileLookup::NoFile(NoFile::Outside(above.to_path_buf()));
        assert_eq!(link("up", above), up);
        std::fs::create_dir(root.join(".work")).unwrap();
        let hidden = FileLookup::NoFile(NoFile::Outside(root.join(".work")));
        assert_eq!(link("work", &root.join(".work")), hidden);
        assert_eq!(
            link("self", &root.join("self")),
            FileLookup::NoFile(NoFile::Loop)
        );
        let gone = PathBuf::from("gone.xodr");
        assert_eq!(
            link("b.xodr", &gone),
            FileLookup::NoFile(NoFile::Dangling(gone))
        );
        let null = link("null.xodr", Path::new("/dev/null"));
        assert_eq!(null, FileLookup::NoFile(NoFile::Special));
        assert_eq!(look_at(&root.join("maps"), &roots), FileLookup::Directory);
        assert_eq!(look_at(&root.join("none"), &roots), FileLookup::Nothing);
        // A path below a link loop may exist.
        let below = look_at(&root.join("self/c.xodr"), &roots);
        assert!(matches!(below, FileLookup::Hidden(_)), "{below:?}");
    }

    #[test]
    fn file_behind_a_linked_directory_is_not_found_there() {
        let (inside, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let root = inside.path().canonicalize().unwrap();
        let outside = outside.path().canonicalize().unwrap();
        let roots = [root.clone()];
        std::fs::write(outside.join("a.xodr"), "<OpenDRIVE/>").unwrap();
        std::fs::create_dir(root.join("maps")).unwrap();
        std::fs::write(root.join("maps/c.xodr"), "").unwrap();
        symlink(root.join("maps"), root.join("inner")).unwrap();
        symlink(&outside, root.join("outer")).unwrap();
        assert!(matches!(
            look_at(&root.join("maps/c.xodr"), &roots),
            FileLookup::File(_)
        ));
        for link in [
            "inner/c.xodr",
            "outer/a.xodr",
            "inner/../a.xodr",
            "maps/../a.xodr",
        ] {
            assert_eq!(look_at(&root.join(link), &roots), FileLookup::Nothing);
            assert!(is_behind_a_link(&root.join(link), &roots));
        }
        assert!(open_directory(&root.join("maps"), &roots).is_ok());
        for link in ["inner", "outer"] {
            assert!(open_directory(&root.join(link), &roots).is_err());
            assert!(has_link(&root, &root.join(link)));
        }
        assert!(!has_link(&root, &root.join("maps")));
    }
}
