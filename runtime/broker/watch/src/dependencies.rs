//! Dependencies of verdicts, wherever they are. Files with kernel events are only scanned from time to time, because
//! kernels and file systems lose events. Files without events must be scanned often.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_disk::foreign;
use qcbus_types::Stamp;

use super::tree::below;
use crate::stamp::stamp_through_links;

/// Interval of scans of files without events.
pub const INTERVAL: Duration = Duration::from_secs(1);

/// Number of intervals in which all files with events are scanned once.
const TURNS: usize = 30;

/// Dependencies with the stamps that were last seen.
#[derive(Debug, Default)]
pub struct Dependencies {
    /// Files that are scanned in every interval.
    polled: BTreeMap<Arc<Path>, Polled>,
    /// Files with kernel events.
    told: BTreeMap<Arc<Path>, Option<Stamp>>,
    /// Last scanned file of `told`. The next scan continues after it.
    last: Option<Arc<Path>>,
}

#[derive(Debug)]
struct Polled {
    stamp: Option<Stamp>,
    /// Whether the check for kernel events was made since the last change of the stamp.
    asked: bool,
}

/// A changed file with its new stamp, or `None` if it was removed.
pub type Changed = (Arc<Path>, Option<Stamp>);

impl Dependencies {
    /// Adds files with the stamps at which they were read; later changes are reported. Returns the changes of known
    /// files that were read with another stamp than the last one seen. Such a file may have appeared and disappeared
    /// since then. A scan would find no change, and earlier readers may not have been informed.
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

    /// Returns the last seen stamp of a file. The outer `None` means that no verdict depends on it.
    fn seen(&self, path: &Path) -> Option<Option<Stamp>> {
        let polled = self.polled.get(path).map(|polled| polled.stamp);
        polled.or_else(|| self.told.get(path).copied())
    }

    /// Removes files that no verdict depends on any more.
    pub fn remove(&mut self, paths: &[Arc<Path>]) {
        for path in paths {
            self.polled.remove(path);
            self.told.remove(path);
        }
    }

    /// Checks whether a verdict depends on the file.
    pub fn contains(&self, path: &Path) -> bool {
        self.seen(path).is_some()
    }

    /// Scans a file immediately because of an event. Returns `None` if it is unchanged or no verdict depends on it.
    pub fn look(&mut self, path: &Path) -> Option<Changed> {
        let polled = self.polled.remove_entry(path);
        let polled = polled.map(|(path, polled)| (path, polled.stamp));
        let (path, seen) = polled.or_else(|| self.told.remove_entry(path))?;
        let stamp = look_through(&path, seen);
        self.poll(path.clone(), stamp);
        (stamp != seen).then_some((path, stamp))
    }

    /// Returns the files below a directory that appeared or disappeared as a whole.
    pub fn below(&self, directory: &Path) -> Vec<Arc<Path>> {
        let polled = below(&self.polled, directory).map(|(path, _)| path);
        let told = below(&self.told, directory).map(|(path, _)| path);
        polled.chain(told).cloned().collect()
    }

    /// Treats all files as files without events, after events were lost or stopped.
    pub fn poll_all(&mut self) {
        for (path, stamp) in std::mem::take(&mut self.told) {
            self.poll(path, stamp);
        }
    }

    fn poll(&mut self, path: Arc<Path>, stamp: Option<Stamp>) {
        let asked = false;
        self.polled.insert(path, Polled { stamp, asked });
    }

    /// Scans the files of this interval. `tells` checks whether the kernel reports changes of a file.
    pub fn changed(&mut self, mut tells: impl FnMut(&Path) -> bool) -> Vec<Changed> {
        let mut changed = self.turn();
        let mut told = Vec::new();
        for (path, polled) in &mut self.polled {
            // This check precedes the scan, so a change in between arrives as an event.
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

    /// Returns files whose change was missed by the events. Only a few are scanned per interval.
    /// The check for kernel events is then repeated for them.
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

/// Returns the current stamp, or the last seen one if the system does not answer.
fn look_through(path: &Path, seen: Option<Stamp>) -> Option<Stamp> {
    let stamp = foreign::access(path, || Ok(stamp_through_links(path)));
    stamp.unwrap_or(seen)
}

/// Checks whether the kernel reports every change of a file in a watched directory. It reports no
/// change through a symbolic link or under another hard link. It also does not report the contents
/// of a directory that is given by its own name.
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

    /// Creates a directory without links in its path.
    fn farm() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        (dir, root)
    }

    #[test]
    fn dependency_removed_before_first_look_is_reported() {
        let (_dir, root) = farm();
        let part = shared(&root.join("part.xml"));
        let mut all = Dependencies::default();
        assert_eq!(all.add(vec![(part.clone(), None)]), []);
        assert_eq!(all.changed(|_| false), []);
        std::fs::write(&part, "1").unwrap();
        let read = stamp_through_links(&part);
        std::fs::remove_file(&part).unwrap();
        // The reader depends on a file that is missing now, and a scan would find no change.
        assert_eq!(all.add(vec![(part.clone(), read)]), [(part.clone(), None)]);
        assert_eq!(all.changed(|_| false), []);
        assert_eq!(all.counts(), [1, 0]);
    }

    #[test]
    fn events_are_relied_on_only_for_plain_files() {
        let ((_dir, root), (_other, outside)) = (farm(), farm());
        std::fs::write(root.join("view.xml"), "").unwrap();
        std::fs::write(outside.join("map.xodr"), "").unwrap();
        assert!(events_tell(&root.join("view.xml")));
        assert!(events_tell(&root.join("to_come.xodr")));
        assert!(
            !events_tell(&root),
            "events do not report the contents of a catalog directory"
        );
        symlink(outside.join("map.xodr"), root.join("map.xodr")).unwrap();
        assert!(
            !events_tell(&root.join("map.xodr")),
            "events do not report a change through a symbolic link"
        );
        std::fs::hard_link(root.join("view.xml"), outside.join("view.xml")).unwrap();
        assert!(
            !events_tell(&root.join("view.xml")),
            "events do not report a change under another hard link"
        );
    }

    #[test]
    fn dependency_change_is_found_with_or_without_events() {
        let (_dir, root) = farm();
        let (map, view) = (root.join("map.xodr"), root.join("view.xml"));
        std::fs::write(&view, "").unwrap();
        let mut all = Dependencies::default();
        all.add(vec![(shared(&map), None), (shared(&view), None)]);
        let tells = |path: &Path| path == view;
        // The file did not exist when it was read.
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
    fn event_covered_dependencies_are_checked_in_turns() {
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
    fn unneeded_dependency_is_not_checked() {
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
    fn all_dependencies_are_polled_without_events() {
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
