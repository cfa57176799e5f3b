//! The thread that looks: what it knows of every file, and what it tells.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::control::Unseen;

use super::dependencies::{self, Changed, Dependencies, RealDirectories, events_tell};
use super::ignore::IgnoreRules;
use super::scan::{Scan, scan};
use super::settle::{QUIET, Settling};
use super::sight::{Sight, look_at};
use super::{Order, Seen, WatchOptions};
use crate::core::Stamp;
use crate::seams::{FileEvents, Receiver, Sender, now, step};
use crate::stamp::{is_younger, stamp_of};

pub(super) struct Looker {
    pub options: WatchOptions,
    pub tell: Box<dyn FnMut(Seen) + Send>,
    pub rules: Vec<IgnoreRules>,
    /// What was last said of every file that is there.
    pub known: HashMap<Arc<Path>, Stamp>,
    /// Symbolic links whose names promise a file: no event tells of what happens behind them.
    links: BTreeSet<PathBuf>,
    /// What could not be looked at, and why; it has been said.
    unseen: BTreeMap<PathBuf, String>,
    pub settling: Settling,
    pub dependencies: Dependencies,
    pub lost_roots: BTreeSet<PathBuf>,
    pub polling: Option<Duration>,
    pub watcher: Option<FileEvents>,
}

impl Looker {
    pub fn new(options: WatchOptions, tell: Box<dyn FnMut(Seen) + Send>) -> Looker {
        let rules = options
            .roots
            .iter()
            .map(|root| IgnoreRules::new(root))
            .collect();
        let polling = options.poll;
        Looker {
            options,
            tell,
            rules,
            known: HashMap::new(),
            links: BTreeSet::new(),
            unseen: BTreeMap::new(),
            settling: Settling::default(),
            dependencies: Dependencies::default(),
            lost_roots: BTreeSet::new(),
            polling,
            watcher: None,
        }
    }

    pub fn run(mut self, inbox: &Receiver<Order>, events: &Sender<Order>) {
        self.watch(events);
        self.scan_all(true);
        (self.tell)(Seen::Scanned);
        let mut next_scan = now() + self.scan_interval();
        let mut next_dependencies = now() + dependencies::INTERVAL;
        loop {
            let begin = now();
            let due = self
                .settling
                .next_due()
                .map_or(next_scan, |due| due.min(next_scan));
            let due = due.min(next_dependencies);
            match inbox.recv_timeout(due.saturating_duration_since(begin)) {
                Ok(Order::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(Order::Depend(files)) => self.dependencies.add(files),
                Ok(Order::Undepend(paths)) => self.dependencies.remove(&paths),
                Ok(Order::Forget(path)) => self.forget(&path),
                Ok(Order::Learn(path, stamp)) => drop(self.known.entry(path).or_insert(stamp)),
                Ok(Order::Look(path)) => self.look(&path),
                Ok(Order::Event(event)) => self.event(event),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let begin = now();
            // A directory may have gone since the next look was fixed.
            next_scan = next_scan.min(begin + self.scan_interval());
            for path in self
                .settling
                .settled(begin, |path| stamp_of(path).ok().flatten())
            {
                self.look(&path);
            }
            if begin >= next_scan {
                self.recover_roots(events);
                self.scan_all(false);
                next_scan = now() + self.scan_interval();
            }
            if begin >= next_dependencies {
                self.look_at_dependencies();
                self.look_behind_links();
                next_dependencies = now() + dependencies::INTERVAL;
            }
        }
    }

    fn scan_interval(&self) -> Duration {
        let wish = self.polling.unwrap_or(self.options.rescan);
        // A directory that has gone is looked for more often than all is looked through.
        if self.lost_roots.is_empty() {
            wish
        } else {
            wish.min(Duration::from_secs(1))
        }
    }

    pub fn ignored(&mut self, path: &Path, is_dir: bool) -> bool {
        self.rules
            .iter_mut()
            .all(|rules| rules.ignores(path, is_dir))
    }

    /// Compares a path with what was last said of it, and says what is new.
    pub fn look(&mut self, path: &Path) {
        if self.is_away(path) {
            return;
        }
        let sight = look_at(path, &self.options.roots);
        step("looked", path);
        let is_checkable = FileKind::of_path(path).is_some() && !self.ignored(path, false);
        if is_checkable && path.is_symlink() {
            self.links.insert(path.to_path_buf());
        } else {
            self.links.remove(path);
        }
        let changed = self.dependencies.look(path);
        match sight {
            Sight::File(stamp) if !is_checkable => {
                self.seen_again(path);
                if self.dependencies.contains(path) {
                    (self.tell)(Seen::Touched(path.into(), stamp));
                }
                return;
            }
            Sight::File(stamp) => {
                self.seen_again(path);
                let path: Arc<Path> = path.into();
                self.known.insert(path.clone(), stamp);
                (self.tell)(Seen::Settled(path, stamp));
                return;
            }
            // One that cannot be looked at may still be there.
            Sight::Hidden(why) => return self.unseen(path, why),
            Sight::NoFile(what) if is_checkable => self.unseen(path, what.to_string()),
            Sight::Directory | Sight::Known | Sight::Nothing | Sight::NoFile(_) => {
                self.seen_again(path);
            }
        }
        if self.known.remove(path).is_some() {
            (self.tell)(Seen::Vanished(path.into()));
        } else if let Some(changed) = changed {
            self.tell_changed(changed);
        }
    }

    fn tell_changed(&mut self, (path, stamp): Changed) {
        if stamp.is_none() && self.is_away(&path) {
            return;
        }
        (self.tell)(match stamp {
            Some(stamp) => Seen::Touched(path, stamp),
            None => Seen::Vanished(path),
        });
    }

    /// What lies in a watched directory that has gone as a whole is kept until it is back.
    fn is_away(&self, path: &Path) -> bool {
        self.lost_roots.iter().any(|root| path.starts_with(root))
    }

    /// The broker found a file gone, of which no event told, and knows nothing of it any more.
    pub fn forget(&mut self, path: &Path) {
        if self.known.remove(path).is_some() {
            self.look(path);
        }
    }

    /// What was said of the files below may not count any more: the next scan says it again.
    pub fn tell_again_below(&mut self, directory: &Path) {
        let below = self
            .known
            .iter_mut()
            .filter(|(path, _)| path.starts_with(directory));
        below.for_each(|(_, stamp)| *stamp = Stamp::default());
    }

    /// Says that something cannot be looked at, once.
    pub fn unseen(&mut self, path: &Path, why: String) {
        let before = self.unseen.insert(path.to_path_buf(), why.clone());
        if before.as_ref() != Some(&why) {
            let path = path.to_path_buf();
            (self.tell)(Seen::Unseen(Unseen { path, why }));
        }
    }

    fn seen_again(&mut self, path: &Path) {
        if self.unseen.remove(path).is_some() {
            (self.tell)(Seen::SeenAgain(path.to_path_buf()));
        }
    }

    /// A directory came as a whole, or what is in it is not known for another reason.
    pub fn scan_below(&mut self, directory: &Path) {
        self.forget_rules_below(directory);
        for index in 0..self.rules.len() {
            if !directory.starts_with(&self.options.roots[index])
                || self.rules[index].ignores(directory, true)
            {
                continue;
            }
            let found = self.scan(directory, index);
            for (path, stamp) in found.files {
                if self.known.get(path.as_path()) != Some(&stamp) {
                    self.settling.seen(&path, stamp, now());
                }
            }
            for it in found.unseen {
                self.unseen(&it.path, it.why);
            }
        }
        self.look_at_dependencies_below(directory);
    }

    fn scan(&mut self, directory: &Path, index: usize) -> Scan {
        let found = scan(directory, &self.options.roots, &mut self.rules[index]);
        self.links.extend(found.links.iter().cloned());
        found
    }

    fn forget_rules_below(&mut self, directory: &Path) {
        for rules in &mut self.rules {
            rules.forget_below(directory);
        }
    }

    /// A directory went as a whole.
    pub fn gone_below(&mut self, directory: &Path) {
        self.forget_rules_below(directory);
        let below = |path: &&Path| path.starts_with(directory);
        let known = self.known.keys().map(|path| &**path).filter(below);
        let unseen = self.unseen.keys().map(PathBuf::as_path).filter(below);
        let gone: BTreeSet<PathBuf> = known.chain(unseen).map(Path::to_path_buf).collect();
        for path in gone {
            self.look(&path);
        }
        self.look_at_dependencies_below(directory);
    }

    fn look_at_dependencies_below(&mut self, directory: &Path) {
        for path in self.dependencies.below(directory) {
            // What is checked itself has been looked at as such.
            if !self.known.contains_key(&path)
                && let Some(changed) = self.dependencies.look(&path)
            {
                self.tell_changed(changed);
            }
        }
    }

    /// Looks through everything. What is new since the last look may still be written to, unless
    /// this is the first look and it is older than the quiet time.
    pub fn scan_all(&mut self, first: bool) {
        // Events may have been lost, those of rule files, too.
        self.rules.iter_mut().for_each(IgnoreRules::forget);
        let (mut present, mut unseen) = (BTreeSet::new(), BTreeSet::new());
        for index in 0..self.options.roots.len() {
            let root = self.options.roots[index].clone();
            if !root.is_dir() {
                self.lose_root(&root);
                let below = |path: &&Arc<Path>| path.starts_with(&root);
                present.extend(self.known.keys().filter(below).cloned());
                unseen.extend(
                    self.unseen
                        .keys()
                        .filter(|it| it.starts_with(&root))
                        .cloned(),
                );
                continue;
            }
            let found = self.scan(&root, index);
            for it in found.unseen {
                self.unseen(&it.path, it.why);
                unseen.insert(it.path);
            }
            for (path, stamp) in found.files {
                present.insert(Arc::from(path.as_path()));
                self.seen_in_scan(&path, stamp, first);
            }
        }
        self.drop_what_is_gone(&present);
        let seen = self.unseen.keys().filter(|path| !unseen.contains(*path));
        for path in seen.cloned().collect::<Vec<_>>() {
            self.seen_again(&path);
        }
    }

    fn drop_what_is_gone(&mut self, present: &BTreeSet<Arc<Path>>) {
        let missed = self.known.keys().filter(|path| !present.contains(*path));
        let mut real = RealDirectories::default();
        for path in missed.cloned().collect::<Vec<_>>() {
            // One that cannot be looked at may still be there, but not behind a link to a directory.
            let is_gone = matches!(stamp_of(&path), Ok(None)) || real.is_behind_a_link(&path);
            if is_gone || self.ignored(&path, false) {
                self.known.remove(&path);
                (self.tell)(Seen::Vanished(path));
            }
        }
    }

    fn seen_in_scan(&mut self, path: &Path, stamp: Stamp, first: bool) {
        if self.known.get(path) == Some(&stamp) {
            return;
        }
        if first && !is_younger(stamp, QUIET) {
            let path: Arc<Path> = path.into();
            self.known.insert(path.clone(), stamp);
            (self.tell)(Seen::Settled(path, stamp));
            return;
        }
        if first {
            // Or what is remembered of it would be taken back when the scan is over.
            (self.tell)(Seen::Present(path.into()));
            // And should it go before it has settled, that is told.
            self.known.insert(path.into(), Stamp::default());
        }
        self.settling.seen(path, stamp, now());
    }

    pub fn look_at_dependencies(&mut self) {
        let is_watched =
            |root: &&PathBuf| self.watcher.is_some() && !self.lost_roots.contains(*root);
        let roots: Vec<PathBuf> = self
            .options
            .roots
            .iter()
            .filter(is_watched)
            .cloned()
            .collect();
        let mut real = RealDirectories::default();
        let tells = |path: &Path| events_tell(path, &roots, &mut real);
        for changed in self.dependencies.changed(tells) {
            self.tell_changed(changed);
        }
    }

    /// What lies behind a link changes without an event of the link.
    pub fn look_behind_links(&mut self) {
        for path in self.links.iter().cloned().collect::<Vec<_>>() {
            match look_at(&path, &self.options.roots) {
                Sight::File(stamp) if self.known.get(path.as_path()) == Some(&stamp) => {}
                // It may still be written to.
                Sight::File(stamp) => self.settling.seen(&path, stamp, now()),
                _ => self.look(&path),
            }
        }
    }
}
