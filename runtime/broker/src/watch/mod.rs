//! Watching directories: events from the kernel where they can be had, looking around at
//! intervals where they cannot, and both with the same outcome.
//!
//! The raw watcher of `notify` is used, not its debouncer: a debouncer holds every event back for
//! its whole window, and a file that was closed or renamed into place is to be checked at once.

mod ignore;
mod scan;
mod settle;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use notify::event::{
    AccessKind, AccessMode, CreateKind, EventKind, ModifyKind, RemoveKind, RenameMode,
};
use notify::{RecommendedWatcher, RecursiveMode, Watcher as _};
use qcbus_document::FileKind;

use self::ignore::{IGNORE_FILE, IgnoreRules, is_ignored_file};
use self::settle::Settling;
use crate::core::Stamp;
use crate::stamp::{age_of, stamp_of, stamp_through_links};

use self::scan::scan;

pub use self::scan::Scan;

/// Every checkable file below a directory, once.
pub fn scan_directory(root: &Path) -> Scan {
    scan(root, &mut IgnoreRules::new(root))
}

/// Whether a file below one of the roots is ignored, by its name or a `.qcignore`.
pub fn is_left_alone(roots: &[PathBuf], file: &Path) -> bool {
    let inside = roots.iter().filter(|root| file.starts_with(root));
    let mut ignored = inside
        .map(|root| IgnoreRules::new(root).ignores(file, false))
        .peekable();
    ignored.peek().is_some() && ignored.all(|it| it)
}

/// What the watcher has to say.
#[derive(Debug)]
pub enum Seen {
    /// A file is there and quiet.
    Settled(Arc<Path>, Stamp),
    /// A file has gone.
    Vanished(Arc<Path>),
    /// The first scan of everything is complete.
    Scanned,
    /// How changes are noticed, for `status`.
    Mode(String),
    /// Something for a person.
    Notice(String),
}

/// How to watch.
#[derive(Debug, Clone)]
pub struct WatchOptions {
    /// Directories, absolute and without symbolic links.
    pub roots: Vec<PathBuf>,
    /// Look around this often instead of relying on events.
    pub poll: Option<Duration>,
    /// Look around this often even when events arrive, because kernels and file systems lose some.
    pub rescan: Duration,
}

/// How often files outside the watched directories, on which verdicts depend, are looked at.
const DEPENDENCY_INTERVAL: Duration = Duration::from_secs(1);

/// A running watcher. It stops when this is dropped.
#[derive(Debug)]
pub struct Watcher {
    orders: Sender<Order>,
}

enum Order {
    Depend(Vec<(Arc<Path>, Option<Stamp>)>),
    Event(notify::Result<notify::Event>),
    Stop,
}

impl Drop for Watcher {
    fn drop(&mut self) {
        // The thread may have ended already; then there is nobody to tell.
        let _ = self.orders.send(Order::Stop);
    }
}

impl Watcher {
    /// Starts watching on a thread of its own; `tell` is called from there.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(
        options: WatchOptions,
        tell: impl FnMut(Seen) + Send + 'static,
    ) -> std::io::Result<Watcher> {
        let (orders, inbox) = channel();
        let events = orders.clone();
        std::thread::Builder::new()
            .name("watch".to_owned())
            .spawn(move || Looker::new(options, Box::new(tell)).run(&inbox, &events))?;
        Ok(Watcher { orders })
    }

    /// Keeps an eye on files on which verdicts depend, wherever they are.
    /// A change since the given stamp is told like any other.
    pub fn depend(&self, files: Vec<(Arc<Path>, Option<Stamp>)>) {
        // The thread only ends when this is dropped.
        let _ = self.orders.send(Order::Depend(files));
    }
}

struct Looker {
    options: WatchOptions,
    tell: Box<dyn FnMut(Seen) + Send>,
    rules: Vec<IgnoreRules>,
    known: HashMap<Arc<Path>, Stamp>,
    settling: Settling,
    dependencies: BTreeMap<Arc<Path>, Option<Stamp>>,
    lost_roots: BTreeSet<PathBuf>,
    polling: Option<Duration>,
    watcher: Option<RecommendedWatcher>,
}

impl Looker {
    fn new(options: WatchOptions, tell: Box<dyn FnMut(Seen) + Send>) -> Looker {
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
            settling: Settling::default(),
            dependencies: BTreeMap::new(),
            lost_roots: BTreeSet::new(),
            polling,
            watcher: None,
        }
    }

    fn run(mut self, inbox: &Receiver<Order>, events: &Sender<Order>) {
        self.watch(events);
        self.scan_all(true);
        (self.tell)(Seen::Scanned);
        let mut next_scan = Instant::now() + self.scan_interval();
        let mut next_dependencies = Instant::now() + DEPENDENCY_INTERVAL;
        loop {
            let now = Instant::now();
            let due = self
                .settling
                .next_due()
                .map_or(next_scan, |due| due.min(next_scan));
            let due = due.min(next_dependencies);
            match inbox.recv_timeout(due.saturating_duration_since(now)) {
                Ok(Order::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(Order::Depend(files)) => self.depend(files),
                Ok(Order::Event(event)) => self.event(event),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = Instant::now();
            for path in self
                .settling
                .settled(now, |path| stamp_of(path).ok().flatten())
            {
                self.look(&path);
            }
            if now >= next_scan {
                self.recover_roots(events);
                self.scan_all(false);
                next_scan = Instant::now() + self.scan_interval();
            }
            if now >= next_dependencies {
                self.look_at_dependencies();
                next_dependencies = Instant::now() + DEPENDENCY_INTERVAL;
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

    /// Asks the kernel for events; where it refuses, says so and looks around instead.
    fn watch(&mut self, events: &Sender<Order>) {
        if let Some(every) = self.options.poll {
            (self.tell)(Seen::Mode(format!(
                "poll every {} s, as asked",
                every.as_secs_f64()
            )));
            return;
        }
        let events = events.clone();
        let watcher = notify::recommended_watcher(move |event| {
            // After the end nobody listens any more.
            let _ = events.send(Order::Event(event));
        });
        let mut watcher = match watcher {
            Ok(watcher) => watcher,
            Err(error) => return self.fall_back(&error.to_string()),
        };
        for root in self.options.roots.clone() {
            if let Err(error) = watcher.watch(&root, RecursiveMode::Recursive) {
                if root.is_dir() {
                    return self.fall_back(&format!("{}: {error}", root.display()));
                }
                self.lose_root(&root);
            }
        }
        self.watcher = Some(watcher);
        (self.tell)(Seen::Mode("events".to_owned()));
    }

    fn fall_back(&mut self, why: &str) {
        let every = Duration::from_secs(2);
        self.polling = Some(every);
        self.watcher = None;
        (self.tell)(Seen::Mode(format!(
            "poll every 2 s, because events cannot be had: {why}"
        )));
        (self.tell)(Seen::Notice(format!(
            "cannot watch by events ({why}); looking around every 2 s instead. \
             On Linux, `sysctl fs.inotify.max_user_watches` is the usual limit."
        )));
    }

    fn lose_root(&mut self, root: &Path) {
        if self.lost_roots.insert(root.to_path_buf()) {
            (self.tell)(Seen::Notice(format!(
                "the watched directory {} is gone; its results are kept, and it is watched again \
                 when it comes back",
                root.display()
            )));
        }
    }

    fn recover_roots(&mut self, events: &Sender<Order>) {
        let back: Vec<PathBuf> = self
            .lost_roots
            .iter()
            .filter(|root| root.is_dir())
            .cloned()
            .collect();
        if back.is_empty() {
            return;
        }
        for root in back {
            self.lost_roots.remove(&root);
            (self.tell)(Seen::Notice(format!(
                "the watched directory {} is back",
                root.display()
            )));
        }
        if self.options.poll.is_none() {
            self.watcher = None;
            self.watch(events);
        }
    }

    fn event(&mut self, event: notify::Result<notify::Event>) {
        let event = match event {
            Ok(event) => event,
            Err(error) => {
                if matches!(error.kind, notify::ErrorKind::MaxFilesWatch) {
                    self.fall_back(&error.to_string());
                } else {
                    (self.tell)(Seen::Notice(format!("watching: {error}")));
                }
                return;
            }
        };
        if event.need_rescan() {
            (self.tell)(Seen::Notice(
                "the kernel dropped file events; everything is looked through again".to_owned(),
            ));
            self.scan_all(false);
            return;
        }
        for path in &event.paths {
            self.path_event(event.kind, path);
        }
    }

    fn path_event(&mut self, kind: EventKind, path: &Path) {
        if is_only_reading(kind) {
            return;
        }
        if path.file_name().is_some_and(|name| name == IGNORE_FILE) {
            return self.scan_all(false);
        }
        if self.options.roots.iter().any(|root| root == path) {
            if matches!(
                kind,
                EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_))
            ) && !path.is_dir()
            {
                self.lose_root(path);
            }
            return;
        }
        match kind {
            EventKind::Access(AccessKind::Close(AccessMode::Write))
            | EventKind::Modify(ModifyKind::Name(
                RenameMode::To | RenameMode::Both | RenameMode::Any,
            )) => {
                self.finished(path);
            }
            EventKind::Create(CreateKind::Folder) => self.scan_below(path),
            EventKind::Remove(RemoveKind::Folder) => self.gone_below(path),
            EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(RenameMode::From)) => {
                self.finished(path);
            }
            EventKind::Create(_) | EventKind::Modify(_) | EventKind::Any | EventKind::Other => {
                self.touched(path);
            }
            EventKind::Access(_) => {}
        }
    }

    /// Closed, renamed or removed: look at once.
    fn finished(&mut self, path: &Path) {
        self.settling.done(path);
        if path.is_dir() && !path.is_symlink() {
            return self.scan_below(path);
        }
        if self.known.contains_key(path) || self.cares_about(path) {
            self.look(path);
        } else if FileKind::of_path(path).is_none() && !path.exists() {
            self.gone_below(path);
        }
    }

    fn touched(&mut self, path: &Path) {
        if self.cares_about(path) {
            self.settling
                .touched(path, stamp_of(path).ok().flatten(), Instant::now());
        }
    }

    fn cares_about(&mut self, path: &Path) -> bool {
        let checkable =
            FileKind::of_path(path).is_some() && !path.file_name().is_some_and(is_ignored_file);
        self.dependencies.contains_key(path) || (checkable && !self.ignored(path))
    }

    fn ignored(&mut self, path: &Path) -> bool {
        self.rules
            .iter_mut()
            .all(|rules| rules.ignores(path, false))
    }

    /// Compares a path with what was last said of it, and says what is new.
    fn look(&mut self, path: &Path) {
        let stamp = match stamp_of(path) {
            Ok(stamp) => stamp,
            Err(error) => {
                (self.tell)(Seen::Notice(format!(
                    "cannot look at {}: {error}",
                    path.display()
                )));
                return;
            }
        };
        let shared: Arc<Path> = path.into();
        if let Some(seen) = self.dependencies.get_mut(path) {
            *seen = stamp_through_links(path);
        }
        match stamp {
            Some(stamp) => {
                self.known.insert(shared.clone(), stamp);
                (self.tell)(Seen::Settled(shared, stamp));
            }
            None if self.known.remove(path).is_some() || self.dependencies.contains_key(path) => {
                (self.tell)(Seen::Vanished(shared));
            }
            None => {}
        }
    }

    fn scan_below(&mut self, directory: &Path) {
        self.forget_rules_below(directory);
        for index in 0..self.rules.len() {
            if !directory.starts_with(&self.options.roots[index])
                || self.rules[index].ignores(directory, true)
            {
                continue;
            }
            let found = scan(directory, &mut self.rules[index]);
            for (path, stamp) in found.files {
                if self.known.get(path.as_path()) != Some(&stamp) {
                    self.settling.seen(&path, stamp, Instant::now());
                }
            }
        }
    }

    fn forget_rules_below(&mut self, directory: &Path) {
        for rules in &mut self.rules {
            rules.forget_below(directory);
        }
    }

    fn gone_below(&mut self, directory: &Path) {
        self.forget_rules_below(directory);
        let gone: Vec<Arc<Path>> = self
            .known
            .keys()
            .filter(|path| path.starts_with(directory))
            .cloned()
            .collect();
        for path in gone {
            self.look(&path);
        }
    }

    /// Looks through everything. What is new since the last look may still be written to, unless
    /// this is the first look and it is older than the quiet time.
    fn scan_all(&mut self, first: bool) {
        // Events may have been lost, those of rule files, too.
        self.rules.iter_mut().for_each(IgnoreRules::forget);
        let mut present = BTreeSet::new();
        for index in 0..self.options.roots.len() {
            let root = self.options.roots[index].clone();
            if !root.is_dir() {
                self.lose_root(&root);
                let kept = self
                    .known
                    .keys()
                    .filter(|path| path.starts_with(&root))
                    .cloned();
                present.extend(kept.collect::<Vec<_>>());
                continue;
            }
            let found = scan(&root, &mut self.rules[index]);
            for failure in found.failures {
                (self.tell)(Seen::Notice(failure));
            }
            for (path, stamp) in found.files {
                present.insert(Arc::from(path.as_path()));
                self.seen_in_scan(&path, stamp, first);
            }
        }
        let gone: Vec<Arc<Path>> = self
            .known
            .keys()
            .filter(|path| !present.contains(*path))
            .cloned()
            .collect();
        for path in gone {
            // One that cannot be looked at may still be there.
            if matches!(stamp_of(&path), Ok(None)) || self.ignored(&path) {
                self.known.remove(&path);
                (self.tell)(Seen::Vanished(path));
            }
        }
    }

    fn seen_in_scan(&mut self, path: &Path, stamp: Stamp, first: bool) {
        if self.known.get(path) == Some(&stamp) {
            return;
        }
        if first && is_quiet(stamp) {
            let path: Arc<Path> = path.into();
            self.known.insert(path.clone(), stamp);
            (self.tell)(Seen::Settled(path, stamp));
        } else {
            self.settling.seen(path, stamp, Instant::now());
        }
    }

    fn depend(&mut self, files: Vec<(Arc<Path>, Option<Stamp>)>) {
        for (path, stamp) in files {
            self.dependencies.entry(path).or_insert(stamp);
        }
    }

    fn look_at_dependencies(&mut self) {
        let mut changed = Vec::new();
        for (path, seen) in &mut self.dependencies {
            let stamp = stamp_through_links(path);
            if stamp != *seen {
                *seen = stamp;
                changed.push((path.clone(), stamp));
            }
        }
        for (path, stamp) in changed {
            (self.tell)(match stamp {
                Some(stamp) => Seen::Settled(path, stamp),
                None => Seen::Vanished(path),
            });
        }
    }
}

/// Whether somebody has only looked at the file, as the watcher itself does with a `.qcignore`.
fn is_only_reading(kind: EventKind) -> bool {
    matches!(kind, EventKind::Access(access) if access != AccessKind::Close(AccessMode::Write))
}

/// Whether a file was last written to long enough ago.
fn is_quiet(stamp: Stamp) -> bool {
    age_of(stamp.mtime_ns) > i128::try_from(settle::QUIET.as_nanos()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A looker around one directory, and what it says.
    fn looker(root: &Path) -> (Looker, Receiver<Seen>) {
        let (tell, told) = channel();
        let options = WatchOptions {
            roots: vec![root.to_path_buf()],
            poll: None,
            rescan: Duration::MAX,
        };
        let tell = Box::new(move |seen| tell.send(seen).unwrap());
        (Looker::new(options, tell), told)
    }

    fn vanished(told: &Receiver<Seen>) -> Vec<PathBuf> {
        let path = |seen| match seen {
            Seen::Vanished(path) => Some(path.to_path_buf()),
            _ => None,
        };
        told.try_iter().filter_map(path).collect()
    }

    #[test]
    fn a_file_that_cannot_be_looked_at_has_not_gone() {
        let dir = tempfile::tempdir().unwrap();
        let (below, aside) = (dir.path().join("maps"), dir.path().join("aside.d"));
        std::fs::create_dir(&below).unwrap();
        std::fs::write(below.join("a.xodr"), "").unwrap();
        let (mut looker, told) = looker(dir.path());
        looker.look(&below.join("a.xodr"));
        // Root may look into every directory, but through a link to itself nobody sees anything.
        std::fs::rename(&below, &aside).unwrap();
        std::os::unix::fs::symlink(&below, &below).unwrap();
        looker.scan_all(false);
        assert_eq!(vanished(&told), Vec::<PathBuf>::new());
        std::fs::remove_file(&below).unwrap();
        looker.scan_all(false);
        assert_eq!(vanished(&told), [below.join("a.xodr")]);
    }

    #[test]
    fn looking_through_everything_reads_the_rules_afresh() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.xodr");
        std::fs::write(&file, "").unwrap();
        let (mut looker, told) = looker(dir.path());
        looker.look(&file);
        looker.scan_all(false);
        assert_eq!(vanished(&told), Vec::<PathBuf>::new());
        std::fs::write(dir.path().join(IGNORE_FILE), "*.xodr\n").unwrap();
        looker.scan_all(false);
        assert_eq!(vanished(&told), [file]);
    }

    #[test]
    fn reading_a_file_is_no_change_of_it() {
        use AccessKind::{Close, Open, Read};
        for access in [
            Read,
            Open(AccessMode::Any),
            Open(AccessMode::Write),
            Close(AccessMode::Read),
        ] {
            assert!(is_only_reading(EventKind::Access(access)), "{access:?}");
        }
        assert!(!is_only_reading(EventKind::Access(Close(
            AccessMode::Write
        ))));
        assert!(!is_only_reading(EventKind::Create(CreateKind::File)));
    }
}
