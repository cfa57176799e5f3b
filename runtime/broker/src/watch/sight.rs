//! What lies at a path: a file, perhaps behind a symbolic link, or why there is none to be seen.

use std::io;
use std::path::{Path, PathBuf};

use crate::core::Stamp;
use crate::stamp::from_metadata;

/// What lies at a path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sight {
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

/// Looks at a path. `roots` are the directories that are looked at, without symbolic links.
pub fn look_at(path: &Path, roots: &[PathBuf]) -> Sight {
    match std::fs::symlink_metadata(path) {
        Ok(data) if data.is_file() => Sight::File(from_metadata(&data)),
        Ok(data) if data.is_dir() => Sight::Directory,
        Ok(data) if data.is_symlink() => behind(path, roots),
        Ok(_) => Sight::NoFile(NoFile::Special),
        Err(error) if is_absent(&error) => Sight::Nothing,
        Err(error) => Sight::Hidden(format!("cannot look at it: {error}")),
    }
}

fn behind(link: &Path, roots: &[PathBuf]) -> Sight {
    match std::fs::metadata(link) {
        Ok(data) if data.is_file() => Sight::File(from_metadata(&data)),
        Ok(data) if data.is_dir() => match std::fs::canonicalize(link) {
            Ok(real) if roots.iter().any(|root| real.starts_with(root)) => Sight::Known,
            Ok(real) => Sight::NoFile(NoFile::Outside(real)),
            Err(error) => Sight::Hidden(format!("cannot look behind this link: {error}")),
        },
        Ok(_) => Sight::NoFile(NoFile::Special),
        Err(error) if is_absent(&error) => {
            // It may have gone meanwhile; then there is nothing to name.
            let target = std::fs::read_link(link).unwrap_or_default();
            Sight::NoFile(NoFile::Dangling(target))
        }
        Err(error) if error.raw_os_error() == Some(libc::ELOOP) => Sight::NoFile(NoFile::Loop),
        Err(error) => Sight::Hidden(format!("cannot look behind this link: {error}")),
    }
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
        assert!(matches!(file, Sight::File(_)));
        assert_eq!(link("a.xodr", &outside.join("a.xodr")), file);
        assert_eq!(link("twice.xodr", &root.join("a.xodr")), file);
        assert_eq!(link("inner", &root.join("maps")), Sight::Known);
        let outer = Sight::NoFile(NoFile::Outside(outside.clone()));
        assert_eq!(link("outer", &outside), outer);
        let above = root.parent().unwrap();
        let up = Sight::NoFile(NoFile::Outside(above.to_path_buf()));
        assert_eq!(link("up", above), up);
        assert_eq!(
            link("self", &root.join("self")),
            Sight::NoFile(NoFile::Loop)
        );
        let gone = PathBuf::from("gone.xodr");
        assert_eq!(link("b.xodr", &gone), Sight::NoFile(NoFile::Dangling(gone)));
        let null = link("null.xodr", Path::new("/dev/null"));
        assert_eq!(null, Sight::NoFile(NoFile::Special));
        assert_eq!(look_at(&root.join("maps"), &roots), Sight::Directory);
        assert_eq!(look_at(&root.join("none"), &roots), Sight::Nothing);
        // What lies below a link that leads nowhere may be there.
        let below = look_at(&root.join("self/c.xodr"), &roots);
        assert!(matches!(below, Sight::Hidden(_)), "{below:?}");
    }
}
