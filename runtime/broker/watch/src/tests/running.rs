//! The running watcher, on directories that others change. There are no periodic scans: every
//! report here comes from an event, or from the watcher's reaction to one.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::os::fd::OwnedFd;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use rustix::fs::{CWD, Mode, OFlags, RenameFlags};

use super::farm;
use crate::{Seen, WatchOptions, Watcher};

const NEVER: Duration = Duration::from_secs(86_400);

/// Reports of a watcher on a directory, from its first scan on.
struct Watched {
    told: Receiver<Seen>,
    /// All reports so far, as text.
    said: Vec<String>,
    root: PathBuf,
    _watcher: Watcher,
}

impl Watched {
    fn start(root: &Path) -> Watched {
        let (tell, told) = channel();
        let options = WatchOptions {
            roots: vec![root.to_path_buf()],
            poll: None,
            rescan: NEVER,
            settle: None,
        };
        let tell = move |seen| drop(tell.send(seen));
        let mut watched = Watched {
            told,
            said: Vec::new(),
            root: root.to_path_buf(),
            _watcher: Watcher::start(options, (Arc::default(), 1), None, tell).unwrap(),
        };
        watched.until("Scanned");
        watched
    }

    fn word(&self, seen: &Seen) -> String {
        let name = |path: &Path| {
            let below = path.strip_prefix(&self.root).unwrap_or(path);
            below.display().to_string()
        };
        match seen {
            Seen::Settled(path, _) => format!("settled {}", name(path)),
            Seen::Present(path) => format!("present {}", name(path)),
            Seen::Unfinished(path, ..) => format!("unfinished {}", name(path)),
            Seen::Touched(path, _) => format!("touched {}", name(path)),
            Seen::Vanished(path) => format!("vanished {}", name(path)),
            Seen::Unseen(it) | Seen::Away(it) => format!("unseen {}", name(&it.path)),
            Seen::SeenAgain(path) => format!("seen again {}", name(path)),
            Seen::Scanned => "Scanned".to_owned(),
            Seen::Mode(mode) => format!("mode {mode}"),
            Seen::Notice(notice) => format!("notice {notice}"),
        }
    }

    /// Waits until all these reports have arrived. Other reports may arrive, too.
    fn until_all(&mut self, words: impl IntoIterator<Item = String>) {
        let mut missing: BTreeSet<String> = words.into_iter().collect();
        while !missing.is_empty() {
            match self.told.recv_timeout(Duration::from_secs(30)) {
                Ok(seen) => {
                    let word = self.word(&seen);
                    missing.remove(&word);
                    self.said.push(word);
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    let some: Vec<&String> = missing.iter().take(5).collect();
                    panic!(
                        "{} events were not reported, for example {some:?}",
                        missing.len()
                    );
                }
            }
        }
    }

    fn until(&mut self, word: &str) {
        self.until_all([word.to_owned()]);
    }

    fn has_said(&self, word: &str) -> bool {
        self.said.iter().any(|it| it == word)
    }
}

/// Writes a file aside and renames it into place.
fn put(path: &Path) {
    let aside = path.with_extension("tmp");
    fs::write(&aside, "<OpenDRIVE/>").unwrap();
    fs::rename(aside, path).unwrap();
}

#[test]
fn files_in_new_directories_are_all_reported() {
    let ((_dir, root), (_other, aside)) = (farm(), farm());
    let mut watched = Watched::start(&root);
    for round in 0..100 {
        let at = |name: &str| format!("{name}{round}");
        // `mkdir` and `cp` do it like this.
        fs::create_dir(root.join(at("plain"))).unwrap();
        put(&root.join(at("plain")).join("a.xodr"));
        // `tar x` and `unzip` do it like this.
        let deep = root.join(at("deep")).join("1/2/3/4");
        fs::create_dir_all(&deep).unwrap();
        put(&deep.join("a.xodr"));
        // `rsync --delay-updates` and `mv` do it like this. The directory is then renamed once more at once.
        fs::create_dir_all(aside.join(at("moved")).join("1/2")).unwrap();
        put(&aside.join(at("moved")).join("1/2/a.xodr"));
        fs::rename(aside.join(at("moved")), root.join(at("first"))).unwrap();
        fs::rename(root.join(at("first")), root.join(at("then"))).unwrap();
        put(&root.join(at("then")).join("1/2/b.xodr"));
        // A new directory takes the place of a removed one.
        fs::create_dir(root.join(at("twice"))).unwrap();
        fs::remove_dir(root.join(at("twice"))).unwrap();
        fs::create_dir(root.join(at("twice"))).unwrap();
        put(&root.join(at("twice")).join("a.xodr"));
        watched.until_all([
            format!("settled plain{round}/a.xodr"),
            format!("settled deep{round}/1/2/3/4/a.xodr"),
            format!("settled then{round}/1/2/a.xodr"),
            format!("settled then{round}/1/2/b.xodr"),
            format!("settled twice{round}/a.xodr"),
        ]);
    }
}

#[test]
fn tree_with_many_writers_is_reported_completely() {
    let (_dir, root) = farm();
    let mut watched = Watched::start(&root);
    let names: Vec<PathBuf> = (0..2_000)
        .map(|it| PathBuf::from(format!("{}/{}/{it}/a.xodr", it % 7, it % 31)))
        .collect();
    std::thread::scope(|scope| {
        for part in names.chunks(500) {
            let root = &root;
            scope.spawn(move || {
                for name in part {
                    let path = root.join(name);
                    fs::create_dir_all(path.parent().unwrap()).unwrap();
                    put(&path);
                }
            });
        }
    });
    watched.until_all(names.iter().map(|it| format!("settled {}", it.display())));
}

#[test]
fn replaced_root_is_watched_again() {
    let (_dir, base) = farm();
    let root = base.join("above/inbox");
    fs::create_dir_all(&root).unwrap();
    put(&root.join("old.xodr"));
    let mut watched = Watched::start(&root);

    // The root is removed and created again.
    fs::remove_dir_all(&root).unwrap();
    fs::create_dir(&root).unwrap();
    put(&root.join("a.xodr"));
    watched.until_all(["settled a.xodr".to_owned(), "vanished old.xodr".to_owned()]);
    fs::create_dir(root.join("maps")).unwrap();
    put(&root.join("maps/b.xodr"));
    watched.until("settled maps/b.xodr");

    // Another directory takes the place of the root.
    let new = base.join("above/new");
    fs::create_dir_all(new.join("maps")).unwrap();
    put(&new.join("maps/c.xodr"));
    rustix::fs::renameat_with(CWD, &new, CWD, &root, RenameFlags::EXCHANGE).unwrap();
    fs::rename(&new, base.join("above/aside")).unwrap();
    watched.until_all(["settled maps/c.xodr", "vanished maps/b.xodr"].map(str::to_owned));
    put(&root.join("maps/d.xodr"));
    watched.until("settled maps/d.xodr");
    // Changes in the former root must not be reported.
    put(&base.join("above/aside/e.xodr"));

    // The directory above the root disappears and comes back.
    let whole = watched.said.len();
    fs::rename(base.join("above"), base.join("away")).unwrap();
    put(&base.join("away/inbox/maps/f.xodr"));
    fs::rename(base.join("away"), base.join("above")).unwrap();
    watched.until("settled maps/f.xodr");
    put(&root.join("maps/g.xodr"));
    watched.until("settled maps/g.xodr");
    assert!(!watched.has_said("settled e.xodr"));
    let taken = |it: &&String| it.starts_with("vanished");
    let taken: Vec<&String> = watched.said[whole..].iter().filter(taken).collect();
    assert!(taken.is_empty(), "{taken:?}");
}

#[test]
fn parent_of_a_root_may_be_missing_for_long() {
    let (_dir, base) = farm();
    let root = base.join("above/inbox");
    fs::create_dir_all(root.join("maps")).unwrap();
    put(&root.join("maps/a.xodr"));
    let mut watched = Watched::start(&root);
    fs::rename(base.join("above"), base.join("away")).unwrap();
    while !watched.said.iter().any(|it| it.contains("is gone")) {
        let seen = watched.told.recv_timeout(Duration::from_secs(30)).unwrap();
        watched.said.push(watched.word(&seen));
    }
    put(&base.join("away/inbox/maps/b.xodr"));
    fs::rename(base.join("away"), base.join("above")).unwrap();
    watched.until("settled maps/b.xodr");
    put(&root.join("maps/c.xodr"));
    watched.until("settled maps/c.xodr");
    let said = &watched.said;
    assert!(
        !said.iter().any(|it| it.starts_with("vanished")),
        "{said:?}"
    );
}

/// The watcher reports this once and not every second. It does not scan again and again.
#[test]
fn linked_root_is_gone_until_replaced_by_a_directory() {
    let (_dir, base) = farm();
    let (root, aside) = (base.join("inbox"), base.join("aside"));
    fs::create_dir(&root).unwrap();
    put(&root.join("a.xodr"));
    let mut watched = Watched::start(&root);
    fs::rename(&root, &aside).unwrap();
    symlink(&aside, &root).unwrap();
    let away = |it: &String| it.contains("has become a symbolic link") || it.contains("is gone");
    while !watched.said.iter().any(away) {
        let seen = watched.told.recv_timeout(Duration::from_secs(30)).unwrap();
        watched.said.push(watched.word(&seen));
    }
    // This is several times as long as the pause between two looks.
    while let Ok(seen) = watched.told.recv_timeout(Duration::from_secs(3)) {
        watched.said.push(watched.word(&seen));
    }
    let notices = watched.said.iter().filter(|it| it.starts_with("notice"));
    assert_eq!(notices.count(), 1, "{:?}", watched.said);
    put(&aside.join("b.xodr"));
    fs::remove_file(&root).unwrap();
    fs::rename(&aside, &root).unwrap();
    watched.until("settled b.xodr");
    put(&root.join("c.xodr"));
    watched.until("settled c.xodr");
    let said = &watched.said;
    assert!(!said.contains(&"vanished a.xodr".to_owned()), "{said:?}");
}

/// Creates an outside directory with files, as a target for links.
fn outside() -> (tempfile::TempDir, PathBuf) {
    let (dir, outside) = farm();
    fs::create_dir(outside.join("deep")).unwrap();
    put(&outside.join("behind.xodr"));
    put(&outside.join("deep/behind.xodr"));
    (dir, outside)
}

/// The watcher ignores everything behind a link to a directory. The time of the link's creation and
/// events behind the link do not matter.
#[test]
fn links_to_directories_are_never_followed() {
    let ((_dir, root), (_other, outside)) = (farm(), outside());
    fs::create_dir(root.join("2026-11-20")).unwrap();
    put(&root.join("2026-11-20/a.xodr"));
    symlink(&outside, root.join("before")).unwrap();
    symlink("2026-11-20", root.join("latest")).unwrap();
    let mut watched = Watched::start(&root);
    assert!(watched.has_said("unseen before"));
    watched.until("settled 2026-11-20/a.xodr");

    symlink(&outside, root.join("created")).unwrap();
    symlink(&outside, root.join("link.tmp")).unwrap();
    fs::rename(root.join("link.tmp"), root.join("renamed")).unwrap();
    watched.until_all(["unseen created".to_owned(), "unseen renamed".to_owned()]);
    // This link appears together with its directory.
    fs::create_dir(root.join("new")).unwrap();
    symlink(&outside, root.join("new/inner")).unwrap();
    watched.until("unseen new/inner");
    // The link gets another target, and then its first one again.
    let retarget = |to: &Path| {
        symlink(to, root.join("next")).unwrap();
        fs::rename(root.join("next"), root.join("latest")).unwrap();
    };
    retarget(&outside);
    watched.until("unseen latest");
    retarget(Path::new("2026-11-20"));
    watched.until("seen again latest");

    for behind in ["", "deep"] {
        put(&outside.join(behind).join("new.xodr"));
        fs::create_dir(outside.join(behind).join("just")).unwrap();
        put(&outside.join(behind).join("just/come.xodr"));
    }
    put(&root.join("2026-11-20/b.xodr"));
    put(&root.join("last.xodr"));
    let told = ["settled 2026-11-20/b.xodr", "settled last.xodr"];
    watched.until_all(told.map(str::to_owned));
    let settled: BTreeSet<&str> = watched
        .said
        .iter()
        .filter_map(|it| it.strip_prefix("settled "))
        .collect();
    let expected = ["2026-11-20/a.xodr", "2026-11-20/b.xodr", "last.xodr"];
    assert_eq!(settled, BTreeSet::from(expected));
}

/// Something happens in a directory while a link to another directory replaces it, over and over.
#[test]
fn directory_swapped_for_a_link_is_not_followed() {
    let ((_dir, root), (_other, outside)) = (farm(), outside());
    let mut watched = Watched::start(&root);
    let (maps, aside) = (root.join("maps"), root.join("aside"));
    for _ in 0..300 {
        fs::create_dir(&maps).unwrap();
        fs::write(maps.join("behind.xodr"), "<OpenDRIVE/>").unwrap();
        fs::rename(&maps, &aside).unwrap();
        symlink(&outside, &maps).unwrap();
        fs::remove_file(&maps).unwrap();
        fs::remove_dir_all(&aside).unwrap();
    }
    symlink(&outside, &maps).unwrap();
    put(&root.join("last.xodr"));
    watched.until_all(["settled last.xodr".to_owned(), "unseen maps".to_owned()]);
    // The last report on the file that the directory held.
    let words = |it: &&String| it.ends_with(" maps/behind.xodr");
    let last = watched.said.iter().rev().find(words);
    assert!(
        last.is_none_or(|it| it == "vanished maps/behind.xodr"),
        "{last:?}"
    );
}

#[test]
fn links_to_large_trees_do_not_affect_other_directories() {
    let (_dir, root) = farm();
    symlink("/", root.join("everything")).unwrap();
    symlink("/proc/self/cwd", root.join("magic")).unwrap();
    symlink("..", root.join("up")).unwrap();
    fs::create_dir(root.join("maps")).unwrap();
    let mut watched = Watched::start(&root);
    assert!(watched.has_said("mode events"), "{:?}", watched.said);
    assert!(watched.has_said("unseen everything"));
    put(&root.join("maps/a.xodr"));
    watched.until("settled maps/a.xodr");
}

fn storm(root: &Path, is_over: &AtomicBool) {
    let (here, there) = (root.join("here"), root.join("there"));
    while !is_over.load(Ordering::Relaxed) {
        // The directory moves in circles with all its contents.
        for (from, to) in [("here", "there"), ("there", "third"), ("third", "here")] {
            fs::rename(root.join(from), root.join(to)).unwrap();
        }
        symlink("/", root.join("flips")).unwrap();
        fs::remove_file(root.join("flips")).unwrap();
        symlink(&here, root.join("flips.xodr")).unwrap();
        fs::remove_file(root.join("flips.xodr")).unwrap();
        fs::create_dir(&there).unwrap();
        fs::remove_dir(&there).unwrap();
        fs::write(root.join(super::IGNORE_FILE), "x").unwrap();
    }
}

#[test]
fn event_storm_does_not_delay_other_directories() {
    let (_dir, root) = farm();
    let wide = root.join("here/wide");
    for number in 0..1_500 {
        fs::create_dir_all(wide.join(format!("{number:0>250}"))).unwrap();
    }
    fs::create_dir(root.join("maps")).unwrap();
    let mut watched = Watched::start(&root);
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| storm(&root, &is_over));
        for number in 0..5 {
            put(&root.join(format!("maps/{number}.xodr")));
            watched.until(&format!("settled maps/{number}.xodr"));
            fs::create_dir(root.join(format!("maps/{number}"))).unwrap();
            put(&root.join(format!("maps/{number}/a.xodr")));
            watched.until(&format!("settled maps/{number}/a.xodr"));
        }
        is_over.store(true, Ordering::Relaxed);
    });
    let notices = |it: &&String| it.starts_with("notice");
    let notices: Vec<&String> = watched.said.iter().filter(notices).collect();
    assert!(notices.len() < 20, "{notices:#?}");
    // No event was lost in the storm.
    put(&root.join("here/wide/last.xodr"));
    watched.until("settled here/wide/last.xodr");
}

/// Creates nested directories, deeper than any path can name, with a file in the last one.
fn dig(root: &Path, depth: usize) {
    let flags = OFlags::DIRECTORY | OFlags::CLOEXEC;
    let mut at: OwnedFd = rustix::fs::openat(CWD, root, flags, Mode::empty()).unwrap();
    let name = "d".repeat(200);
    for _ in 0..depth {
        rustix::fs::mkdirat(&at, &name, Mode::RWXU).unwrap();
        at = rustix::fs::openat(&at, &name, flags, Mode::empty()).unwrap();
    }
    let flags = OFlags::CREATE | OFlags::WRONLY;
    rustix::fs::openat(&at, "deepest.xodr", flags, Mode::RWXU).unwrap();
}

/// Fills the root. `remove_dir_all` works with descriptors, too, and needs one for each level.
fn fill_up(root: &Path) {
    dig(root, 300);
}

#[test]
fn too_deep_directory_is_reported_and_the_rest_watched() {
    let (_dir, root) = farm();
    fill_up(&root);
    put(&root.join("a.xodr"));
    let mut watched = Watched::start(&root);
    let settled = |it: &String| it.starts_with("settled") || it.starts_with("present");
    assert!(watched.said.iter().any(settled), "{:?}", watched.said);
    let unseen = |it: &&String| it.starts_with("unseen");
    assert_eq!(watched.said.iter().filter(unseen).count(), 1);
    put(&root.join("b.xodr"));
    watched.until("settled b.xodr");
    let above = root.join("d".repeat(200));
    put(&above.join("c.xodr"));
    let name = above.join("c.xodr");
    let name = name.strip_prefix(&root).unwrap().display().to_string();
    watched.until(&format!("settled {name}"));
}

#[test]
fn many_unseen_entries_are_reported_up_to_a_limit() {
    let (_dir, root) = farm();
    for number in 0..3_000 {
        symlink("nowhere", root.join(format!("{number}.xodr"))).unwrap();
    }
    let mut watched = Watched::start(&root);
    let said = watched.said.iter().filter(|it| it.starts_with("unseen"));
    let said = said.count();
    assert!((100..=1_001).contains(&said), "{said}");
    let found = crate::scan_directory(&root, std::slice::from_ref(&root));
    assert!((100..=1_001).contains(&found.unseen.len()));
    put(&root.join("a.xodr"));
    watched.until("settled a.xodr");
}

#[test]
fn files_with_the_longest_names_are_reported() {
    let (_dir, root) = farm();
    let mut watched = Watched::start(&root);
    let directory = "m".repeat(255);
    let file = format!("{}.xodr", "f".repeat(250));
    fs::create_dir(root.join(&directory)).unwrap();
    let path = root.join(&directory).join(OsStr::new(&file));
    fs::write(root.join("x"), "").unwrap();
    fs::rename(root.join("x"), path).unwrap();
    watched.until(&format!("settled {directory}/{file}"));
}
