//! What lies at a path: a file, perhaps behind a symbolic link, or why there is none to be seen.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use rustix::fs::{CWD, Mode, OFlags, ResolveFlags};
use rustix::io::Errno;

use super::ignore::hidden_above;
use crate::core::Stamp;
use crate::result_paths::leads_upwards;
use crate::stamp::from_metadata;

/// What lies at a path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FileLookup {
    /// A regular file, here or behind a symbolic link.
    File(Stamp),
    /// A directory to look into, no link to one.
    Directory,
    /// A symbolic link to a directory that is looked at where it lies.
    Known,
    /// Nothing.
    Nothing,
    /// Something that is no file and leads to none, and what it is.
    NoFile(NoFile),
    /// It is there, or may be, and cannot be looked at; what the system says.
    Hidden(String),
}

/// What has a name and is no file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoFile {
    /// A symbolic link to nothing.
    Dangling(PathBuf),
    /// A symbolic link that leads back to itself.
    Loop,
    /// A symbolic link to a directory that nobody looks at.
    Outside(PathBuf),
    /// A pipe, a socket or a device.
    Special,
}

impl NoFile {
    /// Whether it is missed whatever its name is: a whole directory may lie behind it. Anything
    /// else is missed only if its name promises a file that is checked.
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
                write!(f, "it is a symbolic link to {target}, which is not there")
            }
            NoFile::Loop => write!(f, "it is a symbolic link that leads back to itself"),
            NoFile::Outside(target) => {
                let target = text(target);
                write!(
                    f,
                    "it is a symbolic link to the directory {target}, and such links are not \
                     followed; name that directory, too, to have it looked at"
                )
            }
            NoFile::Special => write!(f, "it is a pipe, a socket or a device, not a file"),
        }
    }
}

/// Looks at a path. `roots` are the directories that are looked at, without symbolic links. What lies
/// behind a symbolic link to a directory is not looked at: there is nothing.
pub fn look_at(path: &Path, roots: &[PathBuf]) -> FileLookup {
    let looked = foreign::access(path, || Ok(look(path, roots)));
    looked.unwrap_or_else(|error| FileLookup::Hidden(format!("cannot look at it: {error}")))
}

fn look(path: &Path, roots: &[PathBuf]) -> FileLookup {
    if is_behind_a_link(path, roots) {
        return match std::fs::metadata(path) {
            // Of what is behind a link to itself nobody knows whether it has gone.
            Err(error) if !is_absent(&error) => {
                FileLookup::Hidden(format!("cannot look at it: {error}"))
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
        Err(error) => FileLookup::Hidden(format!("cannot look at it: {error}")),
    }
}

fn behind(link: &Path, roots: &[PathBuf]) -> FileLookup {
    match std::fs::metadata(link) {
        Ok(data) if data.is_file() => FileLookup::File(from_metadata(&data)),
        Ok(data) if data.is_dir() => match std::fs::canonicalize(link) {
            Ok(real) if is_looked_into(roots, &real) => FileLookup::Known,
            Ok(real) => FileLookup::NoFile(NoFile::Outside(real)),
            Err(error) => FileLookup::Hidden(format!("cannot look behind this link: {error}")),
        },
        Ok(_) => FileLookup::NoFile(NoFile::Special),
        Err(error) if is_absent(&error) => {
            // It may have gone meanwhile; then there is nothing to name.
            let target = std::fs::read_link(link).unwrap_or_default();
            FileLookup::NoFile(NoFile::Dangling(target))
        }
        Err(error) if error.raw_os_error() == Some(libc::ELOOP) => FileLookup::NoFile(NoFile::Loop),
        Err(error) => FileLookup::Hidden(format!("cannot look behind this link: {error}")),
    }
}

/// Whether a directory is looked at where it lies. Nobody misses what tools keep there.
fn is_looked_into(roots: &[PathBuf], directory: &Path) -> bool {
    let is_inside = roots.iter().any(|root| directory.starts_with(root));
    is_inside && hidden_above(roots, directory).is_none()
}

/// Whether a path below a root leads through a symbolic link to a directory, or has a `..`, which is there only
/// behind one. What lies there is not looked at under this path.
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

/// Opens a directory to read it, if no symbolic link leads there from its root.
///
/// # Errors
/// What the system says; `ELOOP` when there is a link on the way.
pub fn open_directory(directory: &Path, roots: &[PathBuf]) -> io::Result<OwnedFd> {
    let inside = roots.iter().filter(|root| directory.starts_with(root));
    // The nearest one: fewer links can lie between.
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
        // A kernel before 5.6, or a container that does not know of this call.
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
    fn a_link_is_what_it_leads_to() {
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
        // What lies behind a link to a directory has another path, or is nobody's to look at.
        std::fs::write(root.join("maps/c.xodr"), "").unwrap();
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
        // What lies below a link that leads nowhere may be there.
        let below = look_at(&root.join("self/c.xodr"), &roots);
        assert!(matches!(below, FileLookup::Hidden(_)), "{below:?}");
    }
}
