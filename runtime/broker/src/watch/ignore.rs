//! Which files are looked at: the names that editors and copy tools leave behind are not, nor is
//! what a `.qcignore` names (the grammar of `.gitignore`).

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use ignore::gitignore::{Gitignore, GitignoreBuilder};
use qcbus_disk::foreign;

use super::tree::below;

/// Name of the file in which a directory's owner says what is not to be checked.
pub const IGNORE_FILE: &str = ".qcignore";

const SUFFIXES: [&str; 4] = ["~", ".tmp", ".part", ".swp"];

/// Ignore rules below one directory, read when they are first needed.
#[derive(Debug)]
pub struct IgnoreRules {
    root: PathBuf,
    by_directory: BTreeMap<PathBuf, Option<Gitignore>>,
}

impl IgnoreRules {
    /// Rules below `root`.
    pub fn new(root: &Path) -> IgnoreRules {
        IgnoreRules {
            root: root.to_path_buf(),
            by_directory: BTreeMap::new(),
        }
    }

    /// Forgets what was read, because a rule file may have changed.
    pub fn forget(&mut self) {
        self.by_directory.clear();
    }

    /// Forgets what was read in a directory and below it, because it came or went as a whole.
    pub fn forget_below(&mut self, directory: &Path) {
        let below = below(&self.by_directory, directory).map(|(at, _)| at.clone());
        for at in below.collect::<Vec<_>>() {
            self.by_directory.remove(&at);
        }
    }

    /// Whether a path below the root is left alone.
    pub fn ignores(&mut self, path: &Path, is_dir: bool) -> bool {
        let Ok(below) = path.strip_prefix(&self.root) else {
            return true;
        };
        let by_name = if is_dir {
            is_ignored_directory(path)
        } else {
            path.file_name().is_some_and(is_ignored_file)
        };
        by_name
            || below.ancestors().skip(1).any(is_ignored_directory)
            || self.excludes(path, is_dir)
    }

    /// Whether a rule file says so: the nearest that says anything decides.
    fn excludes(&mut self, path: &Path, is_dir: bool) -> bool {
        let mut directory = path.parent();
        while let Some(at) = directory.filter(|at| at.starts_with(&self.root)) {
            if !self.by_directory.contains_key(at) {
                self.by_directory.insert(at.to_path_buf(), read(at));
            }
            if let Some(Some(rules)) = self.by_directory.get(at) {
                let matched = rules.matched_path_or_any_parents(path, is_dir);
                if matched.is_ignore() {
                    return true;
                }
                if matched.is_whitelist() {
                    return false;
                }
            }
            directory = at.parent();
        }
        false
    }
}

/// Whether a `.qcignore` beside a file or in any directory above it excludes the file. The path is absolute.
pub fn is_excluded(file: &Path) -> bool {
    IgnoreRules::new(Path::new("/")).excludes(file, false)
}

/// Whether a file's name alone is reason enough: dotfiles and unfinished copies.
pub fn is_ignored_file(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name.starts_with('.') || SUFFIXES.iter().any(|suffix| name.ends_with(suffix))
}

/// Directories that hold no work of people: git's, and our own state.
pub fn is_ignored_directory(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name == ".git" || name == ".qcbus")
}

/// People write these by hand.
const MOST_OF_RULES: u64 = 1 << 20;

fn read(directory: &Path) -> Option<Gitignore> {
    let file = directory.join(IGNORE_FILE);
    let bytes = match foreign::read(&file, MOST_OF_RULES) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
        Err(error) => {
            tracing::warn!("{}: {error}", file.display());
            return None;
        }
    };
    let mut builder = GitignoreBuilder::new(directory);
    for line in String::from_utf8_lossy(&bytes).lines() {
        // A line that cannot be understood is passed over; the others count.
        if let Err(error) = builder.add_line(Some(file.clone()), line) {
            tracing::warn!("{}: {error}", file.display());
        }
    }
    builder.build().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_unfinished_copies_are_left_alone() {
        for name in [
            ".a.xodr",
            "a.xodr~",
            "a.xodr.tmp",
            "a.xodr.part",
            ".a.xodr.swp",
        ] {
            assert!(is_ignored_file(OsStr::new(name)), "{name}");
        }
        assert!(!is_ignored_file(OsStr::new("a.xodr")));
    }

    #[test]
    fn of_hidden_directories_only_those_of_tools_are_left_alone() {
        let mut rules = IgnoreRules::new(Path::new("/farm"));
        assert!(rules.ignores(Path::new("/farm/.git/a.xodr"), false));
        assert!(rules.ignores(Path::new("/farm/out/.qcbus/x/a.xodr"), false));
        assert!(rules.ignores(Path::new("/farm/.git"), true));
        assert!(!rules.ignores(Path::new("/farm/.github/a.xodr"), false));
    }

    #[test]
    fn qcignore_speaks_gitignore_and_the_nearest_file_decides() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        std::fs::create_dir(root.join("maps")).unwrap();
        std::fs::write(root.join(IGNORE_FILE), "/old/\n*_draft.xodr\n").unwrap();
        std::fs::write(root.join("maps").join(IGNORE_FILE), "!keep_draft.xodr\n").unwrap();
        let mut rules = IgnoreRules::new(root);
        assert!(rules.ignores(&root.join("old/a.xodr"), false));
        assert!(rules.ignores(&root.join("maps/a_draft.xodr"), false));
        assert!(!rules.ignores(&root.join("maps/keep_draft.xodr"), false));
        assert!(!rules.ignores(&root.join("maps/a.xodr"), false));
        assert!(rules.ignores(Path::new("/elsewhere/a.xodr"), false));
    }

    #[test]
    fn file_is_excluded_by_rules_of_any_directory_above_and_not_by_its_name() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        let deep = root.join("vendor/.hidden");
        std::fs::create_dir_all(&deep).unwrap();
        std::fs::write(root.join(IGNORE_FILE), "/vendor/\n").unwrap();
        assert!(is_excluded(&deep.join("a.xodr")));
        assert!(!is_excluded(&root.join("other/.a.xodr")));
        std::fs::write(deep.join(IGNORE_FILE), "!a.xodr\n").unwrap();
        assert!(!is_excluded(&deep.join("a.xodr")));
    }

    #[test]
    fn the_rules_of_a_directory_go_with_it() {
        let dir = tempfile::tempdir().unwrap();
        let (old, beside) = (dir.path().join("maps"), dir.path().join("other"));
        for directory in [&old, &beside] {
            std::fs::create_dir(directory).unwrap();
            std::fs::write(directory.join(IGNORE_FILE), "*.xodr\n").unwrap();
        }
        let mut rules = IgnoreRules::new(dir.path());
        assert!(rules.ignores(&old.join("a.xodr"), false));
        assert!(rules.ignores(&beside.join("a.xodr"), false));
        std::fs::rename(&old, dir.path().join("aside")).unwrap();
        std::fs::create_dir(&old).unwrap();
        rules.forget_below(&old);
        assert!(!rules.ignores(&old.join("a.xodr"), false));
        assert!(rules.ignores(&beside.join("a.xodr"), false));
    }
}
