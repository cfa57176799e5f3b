//! Scanned directories with their kernel watches.
//!
//! The kernel watches single directories. Each one is watched separately before it is scanned.
//! Therefore no change is lost between watch and scan, and a failed watch affects only its
//! directory. Crates that watch trees use the opposite order, or watch a tree as a whole.

use std::borrow::Borrow;
use std::collections::{BTreeMap, HashMap};
use std::io;
use std::ops::Bound;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_disk::foreign;
use qcbus_environment::{FileEvent, Kernel};
use rustix::fs::inotify::ReadFlags;
use rustix::io::Errno;

/// Reason why a directory has no watch.
#[derive(Debug)]
pub enum Unwatched {
    /// The path does not exist any more, or is no directory.
    Gone,
    /// The kernel's limit of watches for this user is reached.
    NoneLeft,
    /// The directory is not readable.
    Closed,
    /// Any other error of the system.
    Refused(io::Error),
}

/// The scanned directories.
#[derive(Debug, Default)]
pub struct Tree {
    kernel: Option<Kernel>,
    /// Directories with the numbers of their watches, if they have one.
    directories: BTreeMap<Arc<Path>, Option<i32>>,
    /// Paths by watch. A directory may have several paths because of mounts.
    watches: HashMap<i32, Vec<Arc<Path>>>,
    /// Number of directories without a watch.
    unwatched: usize,
}

impl Tree {
    /// Opens the kernel's event queue.
    ///
    /// # Errors
    /// When the kernel provides none.
    pub fn open(&mut self) -> io::Result<()> {
        self.kernel = Some(Kernel::open()?);
        Ok(())
    }

    /// Checks whether the event queue is open.
    pub fn is_open(&self) -> bool {
        self.kernel.is_some()
    }

    /// Returns the event queue.
    pub fn kernel(&self) -> Option<&Kernel> {
        self.kernel.as_ref()
    }

    /// Returns the number of directories, and the number of those without a watch.
    pub fn counts(&self) -> (usize, usize) {
        (self.directories.len(), self.unwatched)
    }

    /// Checks whether a directory is one of them.
    pub fn contains(&self, directory: &Path) -> bool {
        self.directories.contains_key(directory)
    }

    /// Checks whether the kernel reports events in a directory.
    pub fn tells_of(&self, directory: &Path) -> bool {
        matches!(self.directories.get(directory), Some(Some(_)))
    }

    /// Returns the directories without a watch.
    pub fn unwatched(&self) -> Vec<Arc<Path>> {
        let without = self.directories.iter().filter(|(_, watch)| watch.is_none());
        without.map(|(path, _)| path.clone()).collect()
    }

    /// Returns the subdirectories of a directory.
    pub fn children(&self, directory: &Path) -> Vec<PathBuf> {
        children(&self.directories, directory)
    }

    /// Watches a directory. A repeated call is cheap, and finds the watch of another directory that
    /// is now at this path.
    ///
    /// # Errors
    /// When the directory cannot be watched.
    pub fn watch(&mut self, directory: &Path) -> Result<(), Unwatched> {
        let Some(kernel) = &self.kernel else {
            return Err(Unwatched::Refused(io::ErrorKind::Unsupported.into()));
        };
        match foreign::access(directory, || Ok(kernel.watch(directory)?)) {
            Ok(watch) => {
                self.put(directory, Some(watch));
                Ok(())
            }
            Err(error) => Err(match Errno::from_io_error(&error) {
                Some(Errno::NOENT | Errno::NOTDIR | Errno::LOOP) => Unwatched::Gone,
                Some(Errno::NOSPC | Errno::NOMEM) => Unwatched::NoneLeft,
                Some(Errno::ACCESS | Errno::PERM) => Unwatched::Closed,
                _ => Unwatched::Refused(error),
            }),
        }
    }

    /// Registers a directory without events.
    pub fn keep_unwatched(&mut self, directory: &Path) {
        self.put(directory, None);
    }

    fn put(&mut self, directory: &Path, watch: Option<i32>) {
        let known = self.directories.get(directory).copied();
        if known == Some(watch) {
            return;
        }
        let path: Arc<Path> = directory.into();
        if let Some(before) = known {
            self.let_go(&path, before);
        }
        match watch {
            Some(watch) => self.watches.entry(watch).or_default().push(path.clone()),
            None => self.unwatched += 1,
        }
        self.directories.insert(path, watch);
    }

    /// Removes a directory and everything below it.
    pub fn remove_below(&mut self, directory: &Path) {
        let below: Vec<Arc<Path>> = below(&self.directories, directory)
            .map(|(path, _)| path.clone())
            .collect();
        for path in below {
            if let Some(watch) = self.directories.remove(&path) {
                self.let_go(&path, watch);
            }
        }
    }

    fn let_go(&mut self, path: &Arc<Path>, watch: Option<i32>) {
        let Some(watch) = watch else {
            self.unwatched -= 1;
            return;
        };
        let Some(paths) = self.watches.get_mut(&watch) else {
            return;
        };
        paths.retain(|it| it != path);
        if paths.is_empty() {
            self.watches.remove(&watch);
            if let Some(kernel) = &self.kernel {
                // The directory may be gone, together with its watch.
                kernel.forget(watch);
            }
        }
    }

    /// Returns the paths of the directory of an event. The last event of a removed directory ends its watch.
    pub fn places(&mut self, told: &FileEvent) -> Vec<Arc<Path>> {
        if !told.what.contains(ReadFlags::IGNORED) {
            return self.watches.get(&told.watch).cloned().unwrap_or_default();
        }
        let paths = self.watches.remove(&told.watch).unwrap_or_default();
        for path in &paths {
            self.directories.remove(path);
        }
        paths
    }

    /// Returns the pending events, at most a few hundred.
    ///
    /// # Errors
    /// The error of the system if the events cannot be read.
    pub fn events(&self) -> io::Result<Vec<FileEvent>> {
        let Some(kernel) = &self.kernel else {
            return Ok(Vec::new());
        };
        kernel.events()
    }
}

/// Returns the entries at a path and below it. They are adjacent, because paths are sorted by components.
pub fn below<'m, K: Borrow<Path> + Ord, V>(
    map: &'m BTreeMap<K, V>,
    path: &'m Path,
) -> impl Iterator<Item = (&'m K, &'m V)> {
    map.range::<Path, _>((Bound::Included(path), Bound::Unbounded))
        .take_while(move |(key, _)| (*key).borrow().starts_with(path))
}

/// Returns the direct children of a directory, each once, even if many entries lie below it.
pub fn children<K: Borrow<Path> + Ord, V>(map: &BTreeMap<K, V>, directory: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut from = Bound::Excluded(directory.to_path_buf());
    loop {
        let next = map
            .range::<Path, _>((from.as_ref().map(PathBuf::as_path), Bound::Unbounded))
            .next();
        let below = next.and_then(|(key, _)| key.borrow().strip_prefix(directory).ok());
        let Some(name) = below.and_then(|it| it.components().next()) else {
            return found;
        };
        found.push(directory.join(name));
        // This is the least name after the current one, because no name contains such a byte.
        let mut behind = name.as_os_str().to_owned();
        behind.push("\0");
        from = Bound::Included(directory.join(behind));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn direct_children_are_listed_once() {
        let paths = [
            "a", "a/b", "a/b/c", "a/b/d/e", "a/bc", "a/b-", "a/c/d/e", "b/c", "ab/c",
        ];
        let map: BTreeMap<PathBuf, ()> = paths.iter().map(|it| (it.into(), ())).collect();
        let found: BTreeSet<PathBuf> = children(&map, Path::new("a")).into_iter().collect();
        let expected = ["a/b", "a/b-", "a/bc", "a/c"].map(PathBuf::from);
        assert_eq!(found, BTreeSet::from(expected));
        assert_eq!(children(&map, Path::new("a")).len(), 4);
        assert_eq!(below(&map, Path::new("a/b")).count(), 3);
        assert_eq!(children(&map, Path::new("c")), Vec::<PathBuf>::new());
    }

    #[test]
    fn directory_with_two_paths_loses_them_one_by_one() {
        let dir = tempfile::tempdir().unwrap();
        let (one, two) = (dir.path().join("one"), dir.path().join("two"));
        std::fs::create_dir(&one).unwrap();
        let mut tree = Tree::default();
        tree.open().unwrap();
        tree.watch(&one).unwrap();
        // The same directory now has another name.
        std::fs::rename(&one, &two).unwrap();
        tree.watch(&two).unwrap();
        tree.remove_below(&one);
        std::fs::write(two.join("a.xodr"), "").unwrap();
        let events = tree.events().unwrap();
        let named = events.iter().filter(|it| it.name.is_some());
        let places: Vec<Arc<Path>> = named
            .flat_map(|it| tree.watches[&it.watch].clone())
            .collect();
        assert!(
            !places.is_empty() && places.iter().all(|it| **it == *two),
            "{places:?}"
        );
        tree.remove_below(&two);
        assert_eq!(tree.counts(), (0, 0));
        assert!(tree.watches.is_empty());
    }
}
