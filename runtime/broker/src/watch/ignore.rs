//! Which files are looked at: the names that editors and copy tools leave behind are not, nor is
//! what lies in hidden directories or what a `.qcignore` names (the grammar of `.gitignore`).
//!
//! Copy tools, snapshots and volumes keep files in hidden directories that are unfinished, old, or seen
//! elsewhere. A hidden directory is looked into if somebody names it: as a watched or given directory, or with
//! `!.name/` in a `.qcignore`.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use ignore::Match;
use ignore::gitignore::{Gitignore, GitignoreBuilder, Glob};
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
        let directory = if is_dir { Some(path) } else { path.parent() };
        let by_name = !is_dir && path.file_name().is_some_and(is_ignored_file);
        by_name || directory.is_none_or(|it| self.passes_over(it)) || self.excludes(path, is_dir)
    }

    /// Whether a directory is not looked into: it is outside of the root, belongs to a tool, or is or lies in a
    /// hidden directory that nobody has named.
    pub fn passes_over(&mut self, directory: &Path) -> bool {
        let Ok(below) = directory.strip_prefix(&self.root) else {
            return true;
        };
        let depth = below.components().count();
        let mut inside = directory.ancestors().take(depth);
        inside.any(|it| is_of_a_tool(it) || (is_hidden(it) && !self.names(it)))
    }

    /// Whether a rule file names a hidden directory itself.
    fn names(&mut self, directory: &Path) -> bool {
        let said = self.said_of(directory, |rules| rules.matched(directory, true));
        said == Some(Said::Kept)
    }

    /// Whether a rule file excludes a path, or a directory in which it lies.
    fn excludes(&mut self, path: &Path, is_dir: bool) -> bool {
        let said = self.said_of(path, |rules| {
            rules.matched_path_or_any_parents(path, is_dir)
        });
        said == Some(Said::Excluded)
    }

    /// What the rule files say of a path: the nearest that says anything decides.
    fn said_of(
        &mut self,
        path: &Path,
        matched: impl Fn(&Gitignore) -> Match<&Glob>,
    ) -> Option<Said> {
        let mut directory = path.parent();
        while let Some(at) = directory.filter(|at| at.starts_with(&self.root)) {
            if !self.by_directory.contains_key(at) {
                self.by_directory.insert(at.to_path_buf(), read(at));
            }
            let rules = self.by_directory.get(at).and_then(Option::as_ref);
            match rules.map(&matched) {
                Some(Match::Ignore(_)) => return Some(Said::Excluded),
                Some(Match::Whitelist(_)) => return Some(Said::Kept),
                Some(Match::None) | None => {}
            }
            directory = at.parent();
        }
        None
    }
}

/// What a rule file says of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Said {
    Excluded,
    /// Excepted from what is left out, with `!`.
    Kept,
}

/// Whether all say that a path is left alone; each has the rules below one root.
pub fn ignores(rules: &mut [IgnoreRules], path: &Path, is_dir: bool) -> bool {
    rules.iter_mut().all(|it| it.ignores(path, is_dir))
}

/// Whether all say that a directory is not looked into.
pub fn passes_over(rules: &mut [IgnoreRules], directory: &Path) -> bool {
    rules.iter_mut().all(|it| it.passes_over(directory))
}

/// Returns the outermost hidden directory for which a directory below the roots is passed over: it lies in it, or is
/// that one.
pub fn hidden_above(roots: &[PathBuf], directory: &Path) -> Option<PathBuf> {
    let mut hidden = None;
    for root in roots.iter().filter(|root| directory.starts_with(root)) {
        let mut rules = IgnoreRules::new(root);
        let above = directory.ancestors().take_while(|it| it != root);
        let above = above.filter(|it| is_hidden(it) && !is_of_a_tool(it) && !rules.names(it));
        // Another root may lie within it.
        hidden = Some(above.last()?.to_path_buf());
    }
    hidden
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

/// Directories that hold no work of people, whoever names them: git's, and our own state.
pub fn is_of_a_tool(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name == ".git" || name == ".qcbus")
}

fn is_hidden(path: &Path) -> bool {
    let name = path.file_name();
    name.is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
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
    fn hidden_directories_below_the_root_are_passed_over() {
        let mut rules = IgnoreRules::new(Path::new("/home/.farm"));
        for path in [".git", "out/.qcbus", ".~tmp~", "cm/..2026_01", ".a/b"] {
            let directory = Path::new("/home/.farm").join(path);
            assert!(rules.ignores(&directory, true), "{path}");
            assert!(rules.ignores(&directory.join("a.xodr"), false), "{path}");
            let roots = ["/home".into(), "/home/.farm".into()];
            let tool = is_of_a_tool(&directory);
            assert_eq!(hidden_above(&roots, &directory).is_none(), tool, "{path}");
        }
        let root = Path::new("/home/.farm");
        assert!(!rules.passes_over(root) && !rules.ignores(root, true));
        assert!(!rules.ignores(&root.join("maps/a.xodr"), false));
        assert_eq!(hidden_above(&[root.into()], &root.join("maps")), None);
    }

    #[test]
    fn hidden_directory_is_looked_into_when_a_rule_names_it() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        std::fs::create_dir_all(root.join("maps")).unwrap();
        std::fs::write(root.join(IGNORE_FILE), "!.work/\n!.git/\n").unwrap();
        std::fs::write(root.join("maps").join(IGNORE_FILE), ".work/\n").unwrap();
        let mut rules = IgnoreRules::new(root);
        let mut looks_into = |path: &str| {
            let inside = !rules.ignores(&root.join(path).join("a.xodr"), false);
            assert_eq!(inside, !rules.passes_over(&root.join(path)), "{path}");
            inside
        };
        assert!(looks_into(".work") && looks_into("other/.work/deep"));
        // Each hidden directory needs a name of its own; the nearest rule file decides; tools stay out.
        assert!(!looks_into(".work/.deeper") && !looks_into(".other/.work"));
        assert!(!looks_into("maps/.work") && !looks_into(".git"));
        assert!(rules.ignores(&root.join(".work/.a.xodr"), false));
        assert!(hidden_above(&[root.into()], &root.join(".work")).is_none());
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
