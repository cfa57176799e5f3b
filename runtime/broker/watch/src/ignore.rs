//! Selection of the files to scan. Temporary names of editors and copy tools are ignored. Hidden
//! directories and paths in a `.qcignore` (the syntax of `.gitignore`) are ignored, too.
//!
//! Copy tools, snapshots and volumes keep unfinished, old or duplicate files in hidden directories.
//! A hidden directory is scanned if it is named explicitly: as a watched or given directory, or
//! with `!.name/` in a `.qcignore`.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use ignore::Match;
use ignore::gitignore::{Gitignore, GitignoreBuilder, Glob};
use qcbus_disk::foreign;

use super::tree::below;

/// Name of the file that excludes paths of a directory from checking.
pub const IGNORE_FILE: &str = ".qcignore";

const SUFFIXES: [&str; 4] = ["~", ".tmp", ".part", ".swp"];

/// Ignore rules below one directory. They are read when first needed.
#[derive(Debug)]
pub struct IgnoreRules {
    root: PathBuf,
    by_directory: BTreeMap<PathBuf, Option<Gitignore>>,
}

impl IgnoreRules {
    /// Creates the rules below `root`.
    pub fn new(root: &Path) -> IgnoreRules {
        IgnoreRules {
            root: root.to_path_buf(),
            by_directory: BTreeMap::new(),
        }
    }

    /// Drops all rules, because a rule file may have changed.
    pub fn forget(&mut self) {
        self.by_directory.clear();
    }

    /// Drops the rules in a directory and below it, because it appeared or disappeared as a whole.
    pub fn forget_below(&mut self, directory: &Path) {
        let below = below(&self.by_directory, directory).map(|(at, _)| at.clone());
        for at in below.collect::<Vec<_>>() {
            self.by_directory.remove(&at);
        }
    }

    /// Checks whether a path is ignored.
    pub fn ignores(&mut self, path: &Path, is_dir: bool) -> bool {
        let directory = if is_dir { Some(path) } else { path.parent() };
        let by_name = !is_dir && path.file_name().is_some_and(is_ignored_file);
        by_name || directory.is_none_or(|it| self.passes_over(it)) || self.excludes(path, is_dir)
    }

    /// Checks whether a directory is not scanned: it is outside of the root, belongs to a tool, or
    /// is at or below a hidden directory without a rule.
    pub fn passes_over(&mut self, directory: &Path) -> bool {
        let Ok(below) = directory.strip_prefix(&self.root) else {
            return true;
        };
        let depth = below.components().count();
        let mut inside = directory.ancestors().take(depth);
        inside.any(|it| is_of_a_tool(it) || (is_hidden(it) && !self.names(it)))
    }

    /// Checks whether a rule file names a hidden directory itself.
    fn names(&mut self, directory: &Path) -> bool {
        let said = self.said_of(directory, |rules| rules.matched(directory, true));
        said == Some(Said::Kept)
    }

    /// Checks whether a rule file excludes a path or a directory above it.
    fn excludes(&mut self, path: &Path, is_dir: bool) -> bool {
        let said = self.said_of(path, |rules| {
            rules.matched_path_or_any_parents(path, is_dir)
        });
        said == Some(Said::Excluded)
    }

    /// Returns the decision of the rule files for a path. The nearest file with a matching rule decides.
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

/// Decision of a rule file for a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Said {
    Excluded,
    /// Included again with `!`.
    Kept,
}

/// Checks whether all rules ignore a path. Each element contains the rules below one root.
pub fn ignores(rules: &mut [IgnoreRules], path: &Path, is_dir: bool) -> bool {
    rules.iter_mut().all(|it| it.ignores(path, is_dir))
}

/// Checks whether all rules exclude a directory from scanning.
pub fn passes_over(rules: &mut [IgnoreRules], directory: &Path) -> bool {
    rules.iter_mut().all(|it| it.passes_over(directory))
}

/// Returns the outermost hidden directory because of which a directory below the roots is not
/// scanned. It may be the directory itself.
pub fn hidden_above(roots: &[PathBuf], directory: &Path) -> Option<PathBuf> {
    let mut hidden = None;
    for root in roots.iter().filter(|root| directory.starts_with(root)) {
        let mut rules = IgnoreRules::new(root);
        let above = directory.ancestors().take_while(|it| it != root);
        let above = above.filter(|it| is_hidden(it) && !is_of_a_tool(it) && !rules.names(it));
        // Another root may lie inside it.
        hidden = Some(above.last()?.to_path_buf());
    }
    hidden
}

/// Checks whether a `.qcignore` next to a file or in any directory above excludes it. The path is absolute.
pub fn is_excluded(file: &Path) -> bool {
    IgnoreRules::new(Path::new("/")).excludes(file, false)
}

/// Checks whether a file is ignored because of its name alone: dotfiles and unfinished copies.
pub fn is_ignored_file(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name.starts_with('.') || SUFFIXES.iter().any(|suffix| name.ends_with(suffix))
}

/// Checks whether a directory belongs to git or qcbus. It is never scanned, even if it is named.
pub fn is_of_a_tool(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name == ".git" || name == ".qcbus")
}

fn is_hidden(path: &Path) -> bool {
    let name = path.file_name();
    name.is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

/// Maximum size of a rule file in bytes. Rule files are written by hand.
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
        // An invalid line is skipped. The other lines stay valid.
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
    fn unfinished_copies_are_ignored() {
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
    fn hidden_directories_below_the_root_are_ignored() {
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
    fn hidden_directory_is_scanned_when_a_rule_names_it() {
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
        // Each hidden directory needs its own rule. The nearest rule file decides. Directories of
        // tools stay excluded.
        assert!(!looks_into(".work/.deeper") && !looks_into(".other/.work"));
        assert!(!looks_into("maps/.work") && !looks_into(".git"));
        assert!(rules.ignores(&root.join(".work/.a.xodr"), false));
        assert!(hidden_above(&[root.into()], &root.join(".work")).is_none());
    }

    #[test]
    fn qcignore_follows_gitignore_and_nearest_file_wins() {
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
    fn file_is_excluded_by_rules_of_any_parent_directory() {
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
    fn rules_of_a_replaced_directory_are_dropped() {
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
