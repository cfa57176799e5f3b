//! The files that a module's command runs. They must not change after the module's checkers were
//! learned.

use std::io;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_messages::Digest;
use sha2::{Digest as _, Sha256};

use crate::look::Look;

/// Maximum size of such a file in bytes. A larger file or an unreadable file is not compared.
const MOST: u64 = 256 << 20;

/// A file that a command runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Program {
    /// Absolute path of the file.
    pub path: PathBuf,
    /// Digest of the file when the module was learned. `None` if it was not computed or the file
    /// could not be read.
    pub digest: Option<Digest>,
}

impl Program {
    /// Creates a program without a digest.
    pub(crate) fn at(path: PathBuf) -> Program {
        Program { path, digest: None }
    }

    /// Stores the current digest of the file.
    pub(crate) fn look(&mut self) {
        self.digest = digest_of(&self.path).ok();
    }
}

fn digest_of(path: &Path) -> io::Result<Digest> {
    let bytes = foreign::read(path, MOST)?;
    Ok(Digest(Sha256::digest(bytes).into()))
}

/// Programs, each with its look when its digest was last found unchanged.
#[derive(Debug)]
pub(crate) struct Programs(Vec<(Program, Option<Look>)>);

impl Programs {
    pub(crate) fn new(programs: &[Program]) -> Programs {
        Programs(programs.iter().map(|it| (it.clone(), None)).collect())
    }

    /// Returns a text for the user if a program differs from the learned one.
    pub(crate) fn changed(&mut self) -> Option<String> {
        self.0.iter_mut().find_map(|(program, seen)| {
            let digest = program.digest?;
            let now = Look::at(&program.path);
            if now.is_some() && now == *seen {
                return None;
            }
            if digest_of(&program.path).is_ok_and(|it| it == digest) {
                *seen = now;
                return None;
            }
            Some(format!(
                "{} has changed since the checkers of this module were determined: they are determined again",
                program.path.display()
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_program_with_changed_bytes_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("module.py");
        std::fs::write(&path, "one").unwrap();
        let mut program = Program::at(path.clone());
        program.look();
        let mut programs = Programs::new(&[program]);
        assert_eq!(programs.changed(), None);
        std::fs::write(&path, "two").unwrap();
        assert!(programs.changed().unwrap().contains("module.py"));
        std::fs::remove_file(&path).unwrap();
        assert!(programs.changed().is_some(), "the file was removed");
        std::fs::write(&path, "one").unwrap();
        assert_eq!(programs.changed(), None, "the file is present again");
    }
}
