//! Scans directories one at a time: finds new and removed entries in a directory, and queues further directories.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_environment::{now, step};
use qcbus_types::Stamp;

use super::Seen;
use super::due::Turn;
use super::ignore::IgnoreRules;
use super::scan::{Listing, cannot_look_into, is_too_much, list};
use super::scanner::Scanner;
use super::tree::{Unwatched, below, children};
use crate::stamp::is_younger;

/// Mode of scanning a directory.
#[derive(Debug, Clone, Copy)]
struct How {
    /// Whether all subdirectories are scanned, not only those that are not known yet.
    whole: bool,
    /// Whether this is the first full scan.
    first: bool,
}

impl Scanner {
    /// Starts a full scan, because events may have been lost.
    pub fn begin_pass(&mut self, first: bool) {
        // The lost events may include changes of rule files.
        self.rules.iter_mut().for_each(IgnoreRules::forget);
        self.begin_to_watch_again();
        self.due.begin_pass(&self.options.roots, first, now());
    }

    /// Scans queued directories for the duration of `slice`.
    pub fn look_through_what_is_due(&mut self, slice: Duration) {
        let begin = now();
        while let Some(turn) = self.due.next() {
            let (directory, how) = match turn {
                Turn::Told(directory) => {
                    let (whole, first) = (false, false);
                    (directory, How { whole, first })
                }
                Turn::Passed { directory, first } => {
                    let whole = true;
                    (directory, How { whole, first })
                }
            };
            self.look_through(&directory, how);
            if now().saturating_duration_since(begin) >= slice {
                break;
            }
        }
        if let Some(first) = self.due.ended_pass(now()) {
            self.open_at_start = None;
            self.end_pass();
            if first {
                (self.tell)(Seen::Scanned);
            }
        }
    }

    /// Scans all directories immediately.
    #[cfg(test)]
    pub fn scan_all(&mut self, first: bool) {
        self.check_roots();
        self.begin_pass(first);
        while !self.due.is_empty() {
            self.look_through_what_is_due(Duration::MAX);
        }
    }

    /// Ends a full scan: scans the known paths that are in no scanned directory.
    fn end_pass(&mut self) {
        let outside = |path: &Path| path.parent().is_none_or(|it| !self.tree.contains(it));
        let known = self.known.keys().map(|it| &**it);
        let unseen = self.unseen.keys().map(PathBuf::as_path);
        let outside: Vec<PathBuf> = known
            .chain(unseen)
            .filter(|path| outside(path) && !self.options.roots.iter().any(|it| it == path))
            .map(Path::to_path_buf)
            .collect();
        for path in outside {
            if self.is_changed(&path) {
                self.look(&path);
            }
        }
        self.is_all_unseen_said();
        self.due.pass_at(now() + self.pass_interval());
    }

    /// Checks whether a file differs from its last reported state.
    fn is_changed(&self, path: &Path) -> bool {
        let now = crate::stamp::stamp_of(path).ok().flatten();
        now.is_none() || self.known.get(path).copied() != now
    }

    fn look_through(&mut self, directory: &Path, how: How) {
        if self.roots.is_away(directory) {
            return;
        }
        let number = self.tree.counts().0 + usize::from(!self.tree.contains(directory));
        if let Some(why) = is_too_much(directory, &self.options.roots, number) {
            return self.unseen(directory, why);
        }
        // The watch is added before the scan, so a change in between is reported, possibly twice.
        if matches!(self.watch_directory(directory), Err(Unwatched::Gone)) {
            return self.gone(directory);
        }
        let mut found = list(directory, &self.options.roots, &mut self.rules);
        step("listed", directory);
        match found.broken.take().map(|error| cannot_look_into(&error)) {
            None => {
                self.seen_again(directory);
                self.drop_what_is_gone(directory, &found);
            }
            Some(None) => return self.gone(directory),
            Some(Some(why)) if !self.ignored(directory, true) => self.unseen(directory, why),
            Some(Some(_)) => {}
        }
        self.take_in(found, how);
        if !how.whole {
            self.look_at_dependencies_in(directory);
        }
    }

    fn take_in(&mut self, found: Listing, how: How) {
        self.links.extend(found.links);
        for (path, stamp) in found.files {
            self.seen_again(&path);
            self.seen_in_passing(&path, stamp, how.first);
        }
        for it in found.unseen {
            self.unseen(&it.path, it.why);
        }
        for directory in found.directories {
            if how.whole {
                self.due.pass_on(directory);
            } else if !self.tree.contains(&directory) {
                self.due.push(&directory);
            }
        }
    }

    /// Handles entries that were in a directory and are missing in its listing.
    fn drop_what_is_gone(&mut self, directory: &Path, found: &Listing) {
        let files = found.files.iter().map(|(path, _)| path.as_path());
        let directories = found.directories.iter().map(PathBuf::as_path);
        let unseen = found.unseen.iter().map(|it| it.path.as_path());
        let directories: HashSet<&Path> = directories.collect();
        let there: HashSet<&Path> = directories.iter().copied().chain(files).collect();
        let hidden: HashSet<&Path> = directories.iter().copied().chain(unseen).collect();
        for path in children(&self.known, directory) {
            if !there.contains(path.as_path()) {
                self.look_below(&path);
            }
        }
        for path in children(&self.unseen, directory) {
            if !hidden.contains(path.as_path()) {
                self.seen_again_below(&path);
            }
        }
        for path in self.tree.children(directory) {
            let leads_to_a_root = self.options.roots.iter().any(|it| it.starts_with(&path));
            if !directories.contains(path.as_path()) && !leads_to_a_root {
                self.gone(&path);
            }
        }
    }

    fn seen_again_below(&mut self, path: &Path) {
        let below = below(&self.unseen, path).map(|(path, _)| path.clone());
        let is_root = |path: &PathBuf| self.options.roots.contains(path);
        let below: Vec<PathBuf> = below.filter(|it| !is_root(it)).collect();
        for path in below {
            self.seen_again(&path);
        }
    }

    fn seen_in_passing(&mut self, path: &Path, stamp: Stamp, first: bool) {
        if self.known.get(path) == Some(&stamp) {
            return;
        }
        if first && !is_younger(stamp, self.settling.rest()) && !self.was_open(path, stamp) {
            let path: Arc<Path> = path.into();
            self.known.insert(path.clone(), stamp);
            (self.tell)(Seen::Settled(path, stamp));
            return;
        }
        if first {
            self.is_there(path);
        }
        self.settling.seen(path, stamp, now());
    }

    /// Handles the removal of a whole directory.
    pub fn gone(&mut self, directory: &Path) {
        if self.is_root_gone(directory) {
            return;
        }
        self.tree.remove_below(directory);
        self.forget_rules_below(directory);
        self.look_below(directory);
        for path in self.dependencies.below(directory) {
            self.look_at_dependency(&path);
        }
    }

    /// Scans again all reported paths at and below a path.
    fn look_below(&mut self, path: &Path) {
        let known = below(&self.known, path).map(|(path, _)| path.to_path_buf());
        let unseen = below(&self.unseen, path).map(|(path, _)| path.clone());
        for path in known.chain(unseen).collect::<Vec<_>>() {
            self.look(&path);
        }
    }

    pub fn forget_rules_below(&mut self, directory: &Path) {
        for rules in &mut self.rules {
            rules.forget_below(directory);
        }
    }

    fn look_at_dependencies_in(&mut self, directory: &Path) {
        for path in self.dependencies.below(directory) {
            if path.parent() == Some(directory) {
                self.look_at_dependency(&path);
            }
        }
    }

    fn look_at_dependency(&mut self, path: &Path) {
        // A checked file is scanned as such.
        if !self.known.contains_key(path)
            && let Some(changed) = self.dependencies.look(path)
        {
            self.tell_changed(changed);
        }
    }
}
