//! Mapping from files to the paths of their results.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

use qcbus_types::leads_upwards;

/// Maps checked files to their results.
#[derive(Debug, Clone)]
pub struct ResultPaths {
    /// Directory of the results, absolute.
    pub out: PathBuf,
    /// Watched or given directories, absolute.
    pub roots: Vec<PathBuf>,
    /// Files given by name, absolute.
    pub files: HashSet<PathBuf>,
    /// Working directory of a single run. The place of each file is its path relative to this
    /// directory, whatever else is given. A broker has none.
    pub here: Option<PathBuf>,
    /// Single file for all results (`check -c`).
    pub single: Option<PathBuf>,
}

impl ResultPaths {
    /// Creates the mapping for a broker: results mirror the watched directories.
    pub fn of_watched(out: PathBuf, roots: Vec<PathBuf>) -> ResultPaths {
        ResultPaths {
            out,
            roots,
            files: HashSet::new(),
            here: None,
            single: None,
        }
    }

    /// Creates the mapping for a single run in the directory `here`. Results mirror the paths from
    /// there. Files elsewhere keep their paths from the root, so equal names never share a result.
    pub fn of_run(
        out: PathBuf,
        here: PathBuf,
        roots: Vec<PathBuf>,
        files: &[PathBuf],
    ) -> ResultPaths {
        ResultPaths {
            files: files.iter().cloned().collect(),
            here: Some(here),
            ..ResultPaths::of_watched(out, roots)
        }
    }

    /// Returns the path for display, relative to the watched directory or the working directory.
    pub fn display(&self, path: &Path) -> PathBuf {
        match &self.here {
            Some(here) => path.strip_prefix(here).unwrap_or(path).to_path_buf(),
            None => self.relative(path),
        }
    }

    /// Returns the relative place of a file, both below the results and behind the gate.
    pub fn relative(&self, path: &Path) -> PathBuf {
        if let Some(here) = &self.here {
            return below(path, here);
        }
        match self.roots.as_slice() {
            [root] if path.starts_with(root) => below(path, root),
            roots if roots.iter().any(|root| path.starts_with(root)) => {
                // With several directories, their own names keep their files apart.
                below(path, &common_ancestor(&roots.iter().collect::<Vec<_>>()))
            }
            // The file belongs to no root, and a bare name might collide with another file.
            _ => below(path, Path::new("/")),
        }
    }

    /// Checks whether the file is among the given or watched ones.
    pub fn contains(&self, path: &Path) -> bool {
        let is_below = |root: &PathBuf| path.starts_with(root) && !leads_upwards(path);
        self.files.contains(path) || self.roots.iter().any(is_below)
    }

    /// Checks whether a result lies in this broker's directory, so that it may be removed. The path
    /// must contain no `..`, because results are named by the path below the directory.
    pub fn owns(&self, xqar: &Path) -> bool {
        let below = xqar.strip_prefix(&self.out).ok();
        below.is_some_and(|it| {
            it.components()
                .all(|part| matches!(part, Component::Normal(_)))
        })
    }

    /// Returns the path for display of the file with this result, or `None` if the result lies elsewhere.
    pub fn shown_at(&self, xqar: &Path) -> Option<PathBuf> {
        let shown = xqar.strip_prefix(&self.out).ok()?;
        let name = shown.file_name()?.as_bytes().strip_suffix(b".xqar")?;
        Some(shown.with_file_name(OsStr::from_bytes(name)))
    }

    /// Returns the path of the result of this file.
    pub fn xqar(&self, path: &Path) -> PathBuf {
        self.single
            .clone()
            .unwrap_or_else(|| with_suffix(&self.out.join(self.relative(path)), ".xqar"))
    }

    /// Returns the path of the verdict file of this file.
    pub fn verdict(&self, path: &Path) -> PathBuf {
        with_suffix(&self.out.join(self.relative(path)), ".verdict.json")
    }
}

/// Returns the path of the verdict file that belongs to a result.
pub fn verdict_beside(xqar: &Path) -> Option<PathBuf> {
    let stem = xqar.as_os_str().as_bytes().strip_suffix(b".xqar")?;
    let stem = Path::new(OsStr::from_bytes(stem));
    Some(with_suffix(stem, ".verdict.json"))
}

/// Returns `path` with a suffix appended to its name.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

fn below(path: &Path, ancestor: &Path) -> PathBuf {
    let rest = path.strip_prefix(ancestor).unwrap_or(path);
    rest.components()
        .filter(|part| matches!(part, Component::Normal(_)))
        .collect()
}

fn common_ancestor(paths: &[&PathBuf]) -> PathBuf {
    let Some((first, rest)) = paths.split_first() else {
        return PathBuf::new();
    };
    let mut ancestor = first.parent().unwrap_or(first).to_path_buf();
    while !rest
        .iter()
        .all(|path| path.parent().unwrap_or(path).starts_with(&ancestor))
    {
        if !ancestor.pop() {
            break;
        }
    }
    ancestor
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(all: &[&str]) -> Vec<PathBuf> {
        all.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn results_mirror_the_watched_directory() {
        let places = ResultPaths::of_watched("/out".into(), paths(&["/farm"]));
        assert_eq!(
            places.xqar(Path::new("/farm/maps/a.xodr")),
            Path::new("/out/maps/a.xodr.xqar")
        );
        let verdict = places.verdict(Path::new("/farm/a.xodr"));
        assert_eq!(verdict, Path::new("/out/a.xodr.verdict.json"));
    }

    #[test]
    fn unwatched_file_has_separate_result_path() {
        let places = ResultPaths::of_watched("/out".into(), paths(&["/farm"]));
        let (inside, outside) = (Path::new("/farm/a.xodr"), Path::new("/old/a.xodr"));
        assert!(places.contains(inside) && !places.contains(outside));
        assert_ne!(places.xqar(inside), places.xqar(outside));
        let shown = places.shown_at(Path::new("/out/maps/a.xodr.xqar"));
        assert_eq!(shown.as_deref(), Some(Path::new("maps/a.xodr")));
        assert_eq!(places.shown_at(Path::new("/elsewhere/a.xodr.xqar")), None);
        assert!(!places.contains(Path::new("/farm/link/../a.xodr")));
    }

    #[test]
    fn only_results_below_own_directory_are_owned() {
        let places = ResultPaths::of_watched("/live/out".into(), paths(&["/farm"]));
        for (path, owned) in [
            ("/live/out/a.xodr.xqar", true),
            ("/live/out/maps/a.xodr.xqar", true),
            ("/live/out-2/a.xodr.xqar", false),
            ("/live/out/../other/a.xodr.xqar", false),
            ("/copy/out/a.xodr.xqar", false),
        ] {
            assert_eq!(places.owns(Path::new(path)), owned, "{path}");
        }
    }

    #[test]
    fn run_results_mirror_paths_below_working_directory() {
        let files = paths(&["/x/a/m.xodr", "/x/b/m.xodr", "/y/m.xodr"]);
        let run = |here: &str, files: &[PathBuf]| {
            ResultPaths::of_run("/out".into(), here.into(), paths(&["/x/c"]), files)
        };
        for given in [&files[..], &files[1..2], &[]] {
            let places = run("/x", given);
            let xqar = |file: &Path| places.xqar(file);
            assert_eq!(xqar(&files[0]), Path::new("/out/a/m.xodr.xqar"));
            assert_eq!(xqar(&files[1]), Path::new("/out/b/m.xodr.xqar"));
            assert_eq!(xqar(&files[2]), Path::new("/out/y/m.xodr.xqar"));
            assert_eq!(
                xqar(Path::new("/x/c/m.xodr")),
                Path::new("/out/c/m.xodr.xqar")
            );
            assert_eq!(places.display(&files[1]), Path::new("b/m.xodr"));
            assert_eq!(places.display(&files[2]), files[2]);
        }
    }

    #[test]
    fn verdict_file_lies_beside_result() {
        let beside = |xqar| verdict_beside(Path::new(xqar));
        let expected = Some(PathBuf::from("/out/a.xodr.verdict.json"));
        assert_eq!(beside("/out/a.xodr.xqar"), expected);
        assert_eq!(beside("/out/a.xodr"), None);
    }

    #[test]
    fn results_of_two_watched_directories_are_separate() {
        let places = ResultPaths::of_watched("/out".into(), paths(&["/x/a", "/x/b"]));
        assert_eq!(
            places.xqar(Path::new("/x/a/m.xodr")),
            Path::new("/out/a/m.xodr.xqar")
        );
        assert_eq!(
            places.xqar(Path::new("/x/b/m.xodr")),
            Path::new("/out/b/m.xodr.xqar")
        );
    }

    #[test]
    fn nested_watched_directory_does_not_move_results() {
        let places = ResultPaths::of_watched("/out".into(), paths(&["/x", "/x/b"]));
        assert_eq!(
            places.xqar(Path::new("/x/b/m.xodr")),
            Path::new("/out/x/b/m.xodr.xqar")
        );
    }
}
