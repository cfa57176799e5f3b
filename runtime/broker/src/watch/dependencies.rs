//! Files on which verdicts depend, wherever they are. Where the kernel tells of their changes they
//! are only looked at now and then, for kernels and file systems lose events; anywhere else
//! looking at them often is the only way.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_disk::foreign;

use super::tree::below;
use crate::core::Stamp;
use crate::stamp::stamp_through_links;

/// How often what no event tells of is looked at.
pub const INTERVAL: Duration = Duration::from_secs(1);

/// In so many intervals all are looked at of which events tell.
const TURNS: usize = 30;

/// The files, each with the stamp that was last seen of it.
#[derive(Debug, Default)]
pub struct Dependencies {
    /// Looked at in every interval.
    polled: BTreeMap<Arc<Path>, Polled>,
    /// Changes of these come as events.
    told: BTreeMap<Arc<Path>, Option<Stamp>>,
    /// The last of `told` that was looked at: the others have their turn after it.
    last: Option<Arc<Path>>,
}

#[derive(Debug)]
struct Polled {
    stamp: Option<Stamp>,
    /// Whether events tell of it has been asked since its stamp last changed.
    asked: bool,
}

/// A file that is not what it was; `None` when it has gone.
pub type Changed = (Arc<Path>, Option<Stamp>);

impl Dependencies {
    /// Adds files, each with the stamp under which it was read: a change since then is one, too. Returns what to tell
    /// of those that are there already and were read as something else than was last seen of them: it may have come
    /// and gone since, so that a look finds nothing new, and whoever read it earlier may not have been told.
    pub fn add(&mut self, files: Vec<(Arc<Path>, Option<Stamp>)>) -> Vec<Changed> {
        let mut changed = Vec::new();
        for (path, stamp) in files {
            match self.seen(&path) {
                None => self.poll(path, stamp),
                Some(seen) if seen == stamp => {}
                Some(seen) => {
                    let now = look_through(&path, seen);
                    self.remove(std::slice::from_ref(&path));
                    self.poll(path.clone(), now);
                    changed.push((path, now));
                }
            }
        }
        changed
    }

    /// The stamp that was last seen of a file; the outer `None`: nothing depends on it.
    fn seen(&self, path: &Path) -> Option<Option<Stamp>> {
        let polled = self.polled.get(path).map(|polled| polled.stamp);
        polled.or_else(|| self.told.get(path).copied())
    }

    /// Forgets files on which nothing depends any more.
    pub fn remove(&mut self, paths: &[Arc<Path>]) {
        for path in paths {
            self.polled.remove(path);
            self.told.remove(path);
        }
    }

    /// Whether some verdict depends on it.
    pub fn contains(&self, path: &Path) -> bool {
        self.seen(path).is_some()
    }

    /// Looks at a file out of turn, because of an event; `None` when it is what it was, or nothing
    /// depends on it.
    pub fn look(&mut self, path: &Path) -> Option<Changed> {
        let polled = self.polled.remove_entry(path);
        let polled = polled.map(|(path, polled)| (path, polled.stamp));
        let (path, seen) = polled.or_else(|| self.told.remove_entry(path))?;
        let stamp = look_through(&path, seen);
        self.poll(path.clone(), stamp);
        (stamp != seen).then_some((path, stamp))
    }

    /// The files below a directory that came or went as a whole.
    pub fn below(&self, directory: &Path) -> Vec<Arc<Path>> {
        let polled = below(&self.polled, directory).map(|(path, _)| path);
        let told = below(&self.told, directory).map(|(path, _)| path);
        polled.chain(told).cloned().collect()
    }

    /// No events come any more, or some were lost.
    pub fn poll_all(&mut self) {
        for (path, stamp) in std::mem::take(&mut self.told) {
            self.poll(path, stamp);
        }
    }

    fn poll(&mut self, path: Arc<Path>, stamp: Option<Stamp>) {
        let asked = false;
        self.polled.insert(path, Polled { stamp, asked });
    }

    /// Looks at what is due in this interval. `tells` says whether events tell of changes of a file.
    pub fn changed(&mut self, mut tells: impl FnMut(&Path) -> bool) -> Vec<Changed> {
        let mut changed = self.turn();
        let mut told = Vec::new();
        for (path, polled) in &mut self.polled {
            // Asked before the look: what changes in between comes as an event.
            if !polled.asked {
                polled.asked = true;
                if tells(path) {
                    told.push(path.clone());
                }
            }
            let stamp = look_through(path, polled.stamp);
            if stamp != polled.stamp {
                polled.stamp = stamp;
                polled.asked = false;
                changed.push((path.clone(), stamp));
            }
        }
        for path in told {
            if let Some(polled) = self.polled.remove(&path) {
                self.told.insert(path, polled.stamp);
            }
        }
        changed
    }

    /// Those of which events should have told and did not, among the few whose turn it is. What
    /// kind of file they are now decides again whether events tell of them.
    fn turn(&mut self) -> Vec<Changed> {
        let due = self.told.len().div_ceil(TURNS);
        let begin = self.last.take().map_or(Bound::Unbounded, Bound::Excluded);
        let rest = self.told.range::<Arc<Path>, _>((begin, Bound::Unbounded));
        let due: Vec<Changed> = rest
            .take(due)
            .map(|(path, stamp)| (path.clone(), *stamp))
            .collect();
        self.last = due.last().map(|(path, _)| path.clone());
        let look = |(path, seen): Changed| {
            let stamp = look_through(&path, seen);
            (stamp != seen).then_some((path, stamp))
        };
        let changed: Vec<Changed> = due.into_iter().filter_map(look).collect();
        for (path, stamp) in &changed {
            self.told.remove(path);
            self.poll(path.clone(), *stamp);
        }
        changed
    }

    #[cfg(test)]
    fn counts(&self) -> [usize; 2] {
        [self.polled.len(), self.told.len()]
    }
}

/// The stamp as it is now; as it was, where others wait for an answer in vain.
fn look_through(path: &Path, seen: Option<Stamp>) -> Option<Stamp> {
    let stamp = foreign::access(path, || Ok(stamp_through_links(path)));
    stamp.unwrap_or(seen)
}

/// Whether the kernel tells of every change of a file whose directory is watched. It does not of
/// what lies behind a symbolic link, of what is written under another name of the same file, nor of
/// what is in a directory by that directory's own name.
pub fn events_tell(path: &Path) -> bool {
    match foreign::symlink_metadata(path) {
        Ok(data) => data.is_file() && data.nlink() == 1,
        Err(error) => error.kind() == std::io::ErrorKind::NotFound,
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::path::PathBuf;

    use super::*;

    fn shared(path: &Path) -> Arc<Path> {
        path.into()
    }

    /// A directory without links in its path.
    fn farm() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        (dir, root)
    }

    #[test]
    fn what_came_was_read_and_went_before_it_was_looked_at_is_told() {
        let (_dir, root) = farm();
        let part = shared(&root.join("part.xml"));
        let mut all = Dependencies::default();
        assert_eq!(all.add(vec![(part.clone(), None)]), []);
        assert_eq!(all.changed(|_| false), []);
        std::fs::write(&part, "1").unwrap();
        let read = stamp_through_links(&part);
        std::fs::remove_file(&part).unwrap();
        // Who read it rests on what is not there, and a look finds what it found before.
        assert_eq!(all.add(vec![(part.clone(), read)]), [(part.clone(), None)]);
        assert_eq!(all.changed(|_| false), []);
        assert_eq!(all.counts(), [1, 0]);
    }

    #[test]
    fn events_tell_of_plain_files_alone() {
        let ((_dir, root), (_other, outside)) = (farm(), farm());
        std::fs::write(root.join("view.xml"), "").unwrap();
        std::fs::write(outside.join("map.xodr"), "").unwrap();
        assert!(events_tell(&root.join("view.xml")));
        assert!(events_tell(&root.join("to_come.xodr")));
        assert!(
            !events_tell(&root),
            "a catalog directory is known by its names"
        );
        symlink(outside.join("map.xodr"), root.join("map.xodr")).unwrap();
        assert!(
            !events_tell(&root.join("map.xodr")),
            "it is written elsewhere"
        );
        std::fs::hard_link(root.join("view.xml"), outside.join("view.xml")).unwrap();
        assert!(!events_tell(&root.join("view.xml")), "it has another name");
    }

    #[test]
    fn a_change_is_found_whether_events_should_have_told_or_not() {
        let (_dir, root) = farm();
        let (map, view) = (root.join("map.xodr"), root.join("view.xml"));
        std::fs::write(&view, "").unwrap();
        let mut all = Dependencies::default();
        all.add(vec![(shared(&map), None), (shared(&view), None)]);
        let tells = |path: &Path| path == view;
        // It was not there when it was read.
        let there = stamp_through_links(&view);
        assert_eq!(all.changed(tells), [(shared(&view), there)]);
        assert_eq!(all.changed(tells), []);
        assert_eq!(all.counts(), [1, 1]);
        std::fs::remove_file(&view).unwrap();
        std::fs::write(&map, "").unwrap();
        let gone = (shared(&view), None);
        let come = (shared(&map), stamp_through_links(&map));
        let mut found: Vec<Changed> = (0..TURNS).flat_map(|_| all.changed(tells)).collect();
        found.sort();
        assert_eq!(found, [come, gone]);
    }

    #[test]
    fn all_of_which_events_tell_have_their_turn_and_few_at_once() {
        let (_dir, root) = farm();
        let paths: Vec<Arc<Path>> = (0..TURNS * 3)
            .map(|number| shared(&root.join(format!("{number}.xodr"))))
            .collect();
        let mut all = Dependencies::default();
        all.add(paths.iter().map(|path| (path.clone(), None)).collect());
        assert_eq!(all.changed(|_| true), []);
        assert_eq!(all.counts(), [0, paths.len()]);
        for path in &paths {
            std::fs::write(path, "").unwrap();
        }
        let mut found = 0;
        for _ in 0..=TURNS {
            let changed = all.changed(|_| true);
            assert!(changed.len() <= 3, "{}", changed.len());
            found += changed.len();
        }
        assert_eq!(found, paths.len());
    }

    #[test]
    fn what_nothing_depends_on_any_more_is_not_looked_at() {
        let (_dir, root) = farm();
        let (map, view) = (shared(&root.join("map.xodr")), shared(&root.join("v.xml")));
        let mut all = Dependencies::default();
        all.add(vec![(map.clone(), None), (view.clone(), None)]);
        all.changed(|path| path == &*view);
        assert_eq!(all.below(&root), [map.clone(), view.clone()]);
        all.remove(&[map.clone(), view.clone()]);
        std::fs::write(&map, "").unwrap();
        std::fs::write(&view, "").unwrap();
        assert_eq!(all.changed(|_| false), []);
        assert!(!all.contains(&map) && !all.contains(&view));
        assert_eq!(all.counts(), [0, 0]);
    }

    #[test]
    fn without_events_all_are_looked_at() {
        let (_dir, root) = farm();
        let view = shared(&root.join("view.xml"));
        let mut all = Dependencies::default();
        all.add(vec![(view.clone(), None)]);
        all.changed(|_| true);
        assert_eq!(all.counts(), [0, 1]);
        all.poll_all();
        assert_eq!(all.counts(), [1, 0]);
        std::fs::write(&view, "").unwrap();
        let there = stamp_through_links(&view);
        assert_eq!(all.changed(|_| false), [(view, there)]);
    }
}
