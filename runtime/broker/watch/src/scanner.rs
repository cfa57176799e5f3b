//! Scanner thread: the known state of every file, and the reports of changes.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;
use std::time::{Duration, Instant};

use qcbus_disk::foreign;
use qcbus_document::FileKind;
use qcbus_environment::{Bell, Receiver, now, step};
use qcbus_messages::control::Unseen;
use qcbus_types::Stamp;

use super::dependencies::{self, Changed, Dependencies, events_tell};
use super::due::Due;
use super::file_lookup::{FileLookup, look_at};
use super::ignore::{IgnoreRules, ignores};
use super::open_files::OpenFiles;
use super::roots::Roots;
use super::scan::{MORE_UNSEEN, MOST_UNSEEN};
use super::settle::Settling;
use super::tree::{Tree, below};
use super::{Known, Order, Seen, WatchOptions};

/// Maximum time of scanning before events and orders are handled.
const SLICE: Duration = Duration::from_millis(20);

/// Maximum number of link targets checked in one interval. Others are checked in later intervals.
const LINKS_AT_ONCE: usize = 5_000;

pub(super) struct Scanner {
    pub options: WatchOptions,
    pub tell: Box<dyn FnMut(Seen) + Send>,
    pub rules: Vec<IgnoreRules>,
    /// Last reported stamp of every existing file.
    pub known: BTreeMap<Arc<Path>, Stamp>,
    /// Symbolic links with names of checkable files. Changes of their targets cause no event.
    pub links: BTreeSet<PathBuf>,
    /// Last link whose target was checked.
    last_link: Option<PathBuf>,
    /// Inaccessible paths with the reported reasons.
    pub unseen: BTreeMap<PathBuf, String>,
    /// Whether there are more of them than were reported.
    is_more_unseen: bool,
    pub settling: Settling,
    /// Files open for writing, as found when the first full scan needed them for the first time.
    pub open_at_start: Option<OpenFiles>,
    pub dependencies: Dependencies,
    pub roots: Roots,
    pub tree: Tree,
    pub due: Due,
    pub polling: super::events::Polling,
    /// Whether an earlier watcher has already completed a full scan.
    goes_on: bool,
}

impl Scanner {
    pub fn new(options: WatchOptions, tell: Box<dyn FnMut(Seen) + Send>) -> Scanner {
        let rules = options
            .roots
            .iter()
            .map(|root| IgnoreRules::new(root))
            .collect();
        Scanner {
            tell,
            rules,
            known: BTreeMap::new(),
            links: BTreeSet::new(),
            last_link: None,
            unseen: BTreeMap::new(),
            is_more_unseen: false,
            settling: Settling::new(options.settle),
            open_at_start: None,
            dependencies: Dependencies::default(),
            roots: Roots::default(),
            tree: Tree::default(),
            due: Due::new(now()),
            polling: super::events::Polling::default(),
            goes_on: false,
            options,
        }
    }

    /// Continues the work of an earlier watcher. Its reported stamps are unknown, so files are reported again.
    pub fn go_on_with(&mut self, known: Known) {
        let files = known.files.into_iter();
        self.known = files.map(|path| (path, Stamp::default())).collect();
        self.goes_on = true;
    }

    pub fn run(mut self, inbox: &Receiver<Order>, bell: &Bell) {
        self.ask_for_events();
        self.check_roots();
        self.begin_pass(!self.goes_on);
        let mut next_look = now() + dependencies::INTERVAL;
        while self.take_orders(inbox) {
            self.take_events();
            self.look_at_what_may_have_settled(now());
            if now() >= next_look {
                self.look_around();
                next_look = now() + dependencies::INTERVAL;
            }
            if self.due.next_pass().is_some_and(|at| at <= now()) {
                self.begin_pass(false);
            }
            self.look_through_what_is_due(SLICE);
            self.wait(bell, next_look);
        }
    }

    /// Scans all paths without events.
    fn look_around(&mut self) {
        self.check_roots();
        self.poll_what_is_not_watched();
        self.look_at_dependencies();
        self.look_behind_links();
    }

    /// Handles all pending orders. Returns `false` when the thread must stop.
    fn take_orders(&mut self, inbox: &Receiver<Order>) -> bool {
        loop {
            match inbox.try_recv() {
                Ok(Order::Stop) | Err(TryRecvError::Disconnected) => return false,
                Ok(Order::Depend(files)) => self.depend(files),
                Ok(Order::Undepend(paths)) => self.dependencies.remove(&paths),
                Ok(Order::Forget(path)) => self.forget(&path),
                Ok(Order::Learn(path, stamp)) => drop(self.known.entry(path).or_insert(stamp)),
                Ok(Order::Look(path)) => self.look_again(&path),
                Err(TryRecvError::Empty) => return true,
            }
        }
    }

    /// Waits for events, orders, or the time of the next scan.
    fn wait(&self, bell: &Bell, next_look: Instant) {
        let begin = now();
        let times = [self.settling.next_due(), self.due.next_pass()];
        let until = times.into_iter().flatten().fold(next_look, Instant::min);
        let idle = self.due.is_empty();
        let rest = if idle {
            until.saturating_duration_since(begin)
        } else {
            Duration::ZERO
        };
        bell.wait(self.tree.kernel(), rest);
    }

    pub fn ignored(&mut self, path: &Path, is_dir: bool) -> bool {
        ignores(&mut self.rules, path, is_dir)
    }

    /// Compares a path with its last reported state, and reports changes.
    pub fn look(&mut self, path: &Path) {
        if self.roots.is_away(path) {
            return;
        }
        let file_lookup = look_at(path, &self.options.roots);
        step("looked", path);
        if file_lookup == FileLookup::Nothing && self.is_root_gone(path) {
            return;
        }
        let is_checkable = FileKind::of_path(path).is_some() && !self.ignored(path, false);
        match foreign::is_symlink(path) {
            Ok(true) if is_checkable && file_lookup != FileLookup::Nothing => {
                self.links.insert(path.to_path_buf());
            }
            Ok(_) => drop(self.links.remove(path)),
            // The system does not answer, so the path counts as unchanged.
            Err(_) => {}
        }
        let changed = self.dependencies.look(path);
        match file_lookup {
            FileLookup::File(stamp) if !is_checkable => return self.no_file_to_check(path, stamp),
            FileLookup::File(stamp) => {
                self.seen_again(path);
                let path: Arc<Path> = path.into();
                self.known.insert(path.clone(), stamp);
                (self.tell)(Seen::Settled(path, stamp));
                return;
            }
            // An inaccessible file may still exist.
            FileLookup::Hidden(why) => return self.unseen(path, why),
            FileLookup::NoFile(what)
                if is_checkable || (what.hides_more() && !self.ignored(path, true)) =>
            {
                self.unseen(path, what.to_string());
            }
            FileLookup::Directory
            | FileLookup::Known
            | FileLookup::Nothing
            | FileLookup::NoFile(_) => {
                self.seen_again(path);
            }
        }
        if self.known.remove(path).is_some() {
            (self.tell)(Seen::Vanished(path.into()));
        } else if let Some(changed) = changed {
            self.tell_changed(changed);
        }
    }

    /// Scans a file that another source has reported. A directory is queued for a scan.
    pub fn look_again(&mut self, path: &Path) {
        if self.tree.contains(path) {
            self.due.push(path);
        }
        self.look_if_at_rest(path);
    }

    /// Handles a file that is not checkable. It may have been before, and verdicts may depend on it.
    fn no_file_to_check(&mut self, path: &Path, stamp: Stamp) {
        self.seen_again(path);
        if self.known.remove(path).is_some() {
            (self.tell)(Seen::Vanished(path.into()));
        }
        if self.dependencies.contains(path) {
            (self.tell)(Seen::Touched(path.into(), stamp));
        }
    }

    fn depend(&mut self, files: Vec<(Arc<Path>, Option<Stamp>)>) {
        for changed in self.dependencies.add(files) {
            self.tell_changed(changed);
        }
    }

    pub fn tell_changed(&mut self, (path, stamp): Changed) {
        if stamp.is_none() && self.roots.is_away(&path) {
            return;
        }
        // The change is reported when the file has settled.
        if stamp.is_some() && self.settling.is_pending(&path) {
            return;
        }
        (self.tell)(match stamp {
            Some(stamp) => Seen::Touched(path, stamp),
            None => Seen::Vanished(path),
        });
    }

    /// Removes a file that the broker found missing without an event. The broker has already removed it.
    pub fn forget(&mut self, path: &Path) {
        if self.known.remove(path).is_some() {
            self.look_if_at_rest(path);
        }
    }

    /// Resets the reported state of the files below a directory. The next scan reports them again.
    pub fn tell_again_below(&mut self, directory: &Path) {
        let below: Vec<Arc<Path>> = below(&self.known, directory)
            .map(|(path, _)| path.clone())
            .collect();
        for path in below {
            self.known.insert(path, Stamp::default());
        }
    }

    /// Reports an inaccessible path once. If there are too many, only the first ones are reported.
    pub fn unseen(&mut self, path: &Path, why: String) {
        if self.unseen.get(path) == Some(&why) {
            return;
        }
        let path = path.to_path_buf();
        if self.unseen.len() < MOST_UNSEEN || self.unseen.contains_key(&path) {
            self.unseen.insert(path.clone(), why.clone());
            (self.tell)(Seen::Unseen(Unseen { path, why }));
        } else if !self.is_more_unseen {
            self.is_more_unseen = true;
            let (path, why) = (self.options.roots[0].clone(), MORE_UNSEEN.to_owned());
            (self.tell)(Seen::Unseen(Unseen { path, why }));
        }
    }

    pub fn seen_again(&mut self, path: &Path) {
        if self.unseen.remove(path).is_some() {
            (self.tell)(Seen::SeenAgain(path.to_path_buf()));
        }
    }

    /// Withdraws the report about further paths after a full scan that lists all inaccessible ones.
    pub fn is_all_unseen_said(&mut self) {
        if self.is_more_unseen && self.unseen.len() < MOST_UNSEEN {
            self.is_more_unseen = false;
            (self.tell)(Seen::SeenAgain(self.options.roots[0].clone()));
        }
    }

    pub fn look_at_dependencies(&mut self) {
        let Scanner {
            tree,
            dependencies,
            roots,
            ..
        } = self;
        let tells = |path: &Path| {
            let directory = path.parent();
            let told = directory.is_some_and(|it| tree.tells_of(it) && !roots.is_away(it));
            told && events_tell(path)
        };
        for changed in dependencies.changed(tells) {
            self.tell_changed(changed);
        }
    }

    /// Checks the targets of links, because their changes cause no event for the link.
    pub fn look_behind_links(&mut self) {
        let begin = self
            .last_link
            .take()
            .map_or(Bound::Unbounded, Bound::Excluded);
        let rest = self.links.range((begin, Bound::Unbounded));
        let turn: Vec<PathBuf> = rest.take(LINKS_AT_ONCE).cloned().collect();
        if turn.len() == LINKS_AT_ONCE {
            self.last_link = turn.last().cloned();
        }
        for path in turn {
            match look_at(&path, &self.options.roots) {
                FileLookup::File(stamp) if self.known.get(path.as_path()) == Some(&stamp) => {}
                // The file may still be written to.
                FileLookup::File(stamp) => self.settling.seen(&path, stamp, now()),
                _ => self.look(&path),
            }
        }
    }
}
