//! The thread that looks: what it knows of every file, and what it tells.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;
use std::time::{Duration, Instant};

use qcbus_disk::foreign;
use qcbus_document::FileKind;
use qcbus_messages::control::Unseen;

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
use crate::core::Stamp;
use crate::environment::{Bell, Receiver, now, step};

/// How long directories are looked through before events and orders have their turn.
const SLICE: Duration = Duration::from_millis(20);

/// Links behind which is looked in every interval; of more, each has its turn.
const LINKS_AT_ONCE: usize = 5_000;

pub(super) struct Scanner {
    pub options: WatchOptions,
    pub tell: Box<dyn FnMut(Seen) + Send>,
    pub rules: Vec<IgnoreRules>,
    /// What was last said of every file that is there.
    pub known: BTreeMap<Arc<Path>, Stamp>,
    /// Symbolic links whose names promise a file: no event tells of what happens behind them.
    pub links: BTreeSet<PathBuf>,
    /// The last of them that was looked behind.
    last_link: Option<PathBuf>,
    /// What could not be looked at, and why; it has been said.
    pub unseen: BTreeMap<PathBuf, String>,
    /// There is more of it than is said.
    is_more_unseen: bool,
    pub settling: Settling,
    /// What was open for writing when the first look began to need that.
    pub open_at_start: Option<OpenFiles>,
    pub dependencies: Dependencies,
    pub roots: Roots,
    pub tree: Tree,
    pub due: Due,
    pub polling: super::events::Polling,
    /// Another has looked through everything before.
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

    /// Takes the place of another. What it said last of each file is not known, and is said again.
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

    /// What no event tells of.
    fn look_around(&mut self) {
        self.check_roots();
        self.poll_what_is_not_watched();
        self.look_at_dependencies();
        self.look_behind_links();
    }

    /// `false`: it is over.
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

    /// Waits for events, orders, or the time to look again.
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

    /// Compares a path with what was last said of it, and says what is new.
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
            // It does not answer: it is what it was.
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
            // One that cannot be looked at may still be there.
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

    /// Looks at a file for somebody who has heard of it elsewhere; a directory is looked through.
    pub fn look_again(&mut self, path: &Path) {
        if self.tree.contains(path) {
            self.due.push(path);
        }
        self.look_if_at_rest(path);
    }

    /// It may have been one before somebody had it ignored, and others may depend on it.
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
        // It is told when it has settled.
        if stamp.is_some() && self.settling.is_pending(&path) {
            return;
        }
        (self.tell)(match stamp {
            Some(stamp) => Seen::Touched(path, stamp),
            None => Seen::Vanished(path),
        });
    }

    /// The broker found a file gone, of which no event told, and knows nothing of it any more.
    pub fn forget(&mut self, path: &Path) {
        if self.known.remove(path).is_some() {
            self.look_if_at_rest(path);
        }
    }

    /// What was said of the files below may not count any more: the next look says it again.
    pub fn tell_again_below(&mut self, directory: &Path) {
        let below: Vec<Arc<Path>> = below(&self.known, directory)
            .map(|(path, _)| path.clone())
            .collect();
        for path in below {
            self.known.insert(path, Stamp::default());
        }
    }

    /// Says that something cannot be looked at, once; of too many things no more than the first.
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

    /// After a look through everything with which all that is unseen has been named.
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

    /// What lies behind a link changes without an event of the link.
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
                // It may still be written to.
                FileLookup::File(stamp) => self.settling.seen(&path, stamp, now()),
                _ => self.look(&path),
            }
        }
    }
}
