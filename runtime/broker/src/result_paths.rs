//! Where the result of a file goes.

use std::collections::{BTreeMap, HashMap};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

/// Maps checked files to their results.
#[derive(Debug, Clone)]
pub struct ResultPaths {
    /// Directory of the results, absolute.
    pub out: PathBuf,
    /// Watched or given directories, absolute.
    pub roots: Vec<PathBuf>,
    /// Files given by name, each with the path of its result below `out`, without suffix.
    pub files: HashMap<PathBuf, PathBuf>,
    /// All results go into one file of this name instead (`check -c`).
    pub single: Option<PathBuf>,
}

impl ResultPaths {
    /// ResultPaths for directories and single files. Files with equal names get their path below the
    /// common ancestor, so that no result hides another.
    pub fn new(out: PathBuf, roots: Vec<PathBuf>, files: &[PathBuf]) -> ResultPaths {
        let mut by_name: BTreeMap<PathBuf, Vec<&PathBuf>> = BTreeMap::new();
        for file in files {
            let name = file.file_name().map(PathBuf::from).unwrap_or_default();
            by_name.entry(name).or_default().push(file);
        }
        let mut names = HashMap::new();
        for (name, same) in by_name {
            let ancestor = common_ancestor(&same);
            for file in &same {
                let below = if same.len() == 1 {
                    name.clone()
                } else {
                    below(file, &ancestor)
                };
                names.insert((*file).clone(), below);
            }
        }
        ResultPaths {
            out,
            roots,
            files: names,
            single: None,
        }
    }

    /// The path for people: relative to the directory given or watched, or a given file's name.
    pub fn display(&self, path: &Path) -> PathBuf {
        if let Some(name) = self.files.get(path) {
            return name.clone();
        }
        match self.roots.as_slice() {
            [root] if path.starts_with(root) => below(path, root),
            roots if roots.iter().any(|root| path.starts_with(root)) => {
                // Several directories: their own names keep their files apart.
                below(path, &common_ancestor(&roots.iter().collect::<Vec<_>>()))
            }
            // Nobody's place: a bare name might be that of another file.
            _ => below(path, Path::new("/")),
        }
    }

    /// Whether the file is among those given or watched.
    pub fn contains(&self, path: &Path) -> bool {
        self.files.contains_key(path) || self.roots.iter().any(|root| path.starts_with(root))
    }

    /// The path for people of the file whose result lies there; `None` when it lies elsewhere.
    pub fn shown_at(&self, xqar: &Path) -> Option<PathBuf> {
        let shown = xqar.strip_prefix(&self.out).ok()?;
        let name = shown.file_name()?.as_bytes().strip_suffix(b".xqar")?;
        Some(shown.with_file_name(OsStr::from_bytes(name)))
    }

    /// Where the result of this file goes.
    pub fn xqar(&self, path: &Path) -> PathBuf {
        self.single
            .clone()
            .unwrap_or_else(|| with_suffix(&self.out.join(self.display(path)), ".xqar"))
    }

    /// Where the verdict file of this file goes.
    pub fn verdict(&self, path: &Path) -> PathBuf {
        with_suffix(&self.out.join(self.display(path)), ".verdict.json")
    }
}

/// `path` with something put behind its name.
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
        let places = ResultPaths::new("/out".into(), paths(&["/farm"]), &[]);
        assert_eq!(
            places.xqar(Path::new("/farm/maps/a.xodr")),
            Path::new("/out/maps/a.xodr.xqar")
        );
        let verdict = places.verdict(Path::new("/farm/a.xodr"));
        assert_eq!(verdict, Path::new("/out/a.xodr.verdict.json"));
    }

    #[test]
    fn what_is_not_watched_has_nobodys_place() {
        let places = ResultPaths::new("/out".into(), paths(&["/farm"]), &[]);
        let (inside, outside) = (Path::new("/farm/a.xodr"), Path::new("/old/a.xodr"));
        assert!(places.contains(inside) && !places.contains(outside));
        assert_ne!(places.xqar(inside), places.xqar(outside));
        let shown = places.shown_at(Path::new("/out/maps/a.xodr.xqar"));
        assert_eq!(shown.as_deref(), Some(Path::new("maps/a.xodr")));
        assert_eq!(places.shown_at(Path::new("/elsewhere/a.xodr.xqar")), None);
    }

    #[test]
    fn equal_names_do_not_collide() {
        let files = paths(&["/x/a/m.xodr", "/x/b/m.xodr", "/x/b/n.xodr"]);
        let places = ResultPaths::new("/out".into(), vec![], &files);
        assert_eq!(places.xqar(&files[0]), Path::new("/out/a/m.xodr.xqar"));
        assert_eq!(places.xqar(&files[1]), Path::new("/out/b/m.xodr.xqar"));
        assert_eq!(places.xqar(&files[2]), Path::new("/out/n.xodr.xqar"));
    }

    #[test]
    fn two_directories_keep_their_files_apart() {
        let places = ResultPaths::new("/out".into(), paths(&["/x/a", "/x/b"]), &[]);
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
    fn a_directory_inside_another_does_not_move_results() {
        let places = ResultPaths::new("/out".into(), paths(&["/x", "/x/b"]), &[]);
        assert_eq!(
            places.xqar(Path::new("/x/b/m.xodr")),
            Path::new("/out/x/b/m.xodr.xqar")
        );
    }
}
