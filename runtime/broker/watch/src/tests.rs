//! The scanner on real directories, without its thread: changes of files and the resulting reports.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

mod running;

use super::ignore::IGNORE_FILE;
use super::scanner::Scanner;
use super::settle::QUIET;
use super::{Seen, WatchOptions};

/// Creates a scanner for one directory, and the receiver of its reports.
fn scanner(root: &Path) -> (Scanner, Receiver<Seen>) {
    let (tell, told) = channel();
    let options = WatchOptions {
        roots: vec![root.to_path_buf()],
        poll: None,
        rescan: Duration::MAX,
        settle: None,
    };
    let tell = Box::new(move |seen| tell.send(seen).unwrap());
    (Scanner::new(options, tell), told)
}

/// Creates a directory without links in its path.
fn farm() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().canonicalize().unwrap();
    (dir, root)
}

/// Returns the reports as text, with paths below `root`.
fn words(root: &Path, told: &Receiver<Seen>) -> Vec<String> {
    let name = |path: &Path| path.strip_prefix(root).unwrap().display().to_string();
    let word = |seen| match seen {
        Seen::Settled(path, _) => format!("settled {}", name(&path)),
        Seen::Present(path) => format!("present {}", name(&path)),
        Seen::Unfinished(path, ..) => format!("unfinished {}", name(&path)),
        Seen::Vanished(path) => format!("vanished {}", name(&path)),
        Seen::Unseen(it) | Seen::Away(it) => format!("unseen {}", name(&it.path)),
        Seen::SeenAgain(path) => format!("seen again {}", name(&path)),
        other => format!("{other:?}"),
    };
    let seen = told.try_iter().filter(|it| !matches!(it, Seen::Scanned));
    seen.map(word).collect()
}

/// Lets all touched files settle.
fn settle(scanner: &mut Scanner) {
    let later = Instant::now() + QUIET * 2;
    scanner.look_at_what_may_have_settled(later);
}

#[test]
fn every_change_of_a_linked_file_is_noticed() {
    let ((_dir, root), (_other, outside)) = (farm(), farm());
    let (link, target) = (root.join("a.xodr"), outside.join("target"));
    std::fs::write(&target, "one").unwrap();
    symlink(&target, &link).unwrap();
    let (mut scanner, told) = scanner(&root);
    let then = |scanner: &mut Scanner| {
        scanner.look_behind_links();
        settle(scanner);
        words(&root, &told)
    };
    scanner.scan_all(true);
    assert_eq!(then(&mut scanner), ["present a.xodr", "settled a.xodr"]);
    assert!(then(&mut scanner).is_empty());

    std::fs::write(&target, "other bytes").unwrap();
    assert_eq!(then(&mut scanner), ["settled a.xodr"], "rewritten");
    std::fs::write(outside.join("new"), "replaced").unwrap();
    std::fs::rename(outside.join("new"), &target).unwrap();
    assert_eq!(then(&mut scanner), ["settled a.xodr"], "replaced");
    std::fs::write(outside.join("other"), "elsewhere").unwrap();
    std::fs::remove_file(&link).unwrap();
    symlink(outside.join("other"), &link).unwrap();
    assert_eq!(then(&mut scanner), ["settled a.xodr"], "pointed elsewhere");

    std::fs::remove_file(outside.join("other")).unwrap();
    let gone = ["unseen a.xodr", "vanished a.xodr"];
    assert_eq!(then(&mut scanner), gone, "dangling");
    scanner.scan_all(false);
    assert!(then(&mut scanner).is_empty(), "reported once");
    std::fs::write(outside.join("other"), "back").unwrap();
    let back = ["seen again a.xodr", "settled a.xodr"];
    assert_eq!(then(&mut scanner), back, "back again");
    std::fs::remove_file(&link).unwrap();
    assert_eq!(then(&mut scanner), ["vanished a.xodr"]);
    assert!(then(&mut scanner).is_empty());
}

#[test]
fn unseen_entries_are_reported_once_and_when_seen_again() {
    let ((_dir, root), (_other, outside)) = (farm(), farm());
    symlink(&outside, root.join("maps")).unwrap();
    symlink(root.join("loop"), root.join("loop")).unwrap();
    symlink("nowhere", root.join("a.xodr")).unwrap();
    // The scanner reports none of the following links.
    symlink("nowhere", root.join("readme")).unwrap();
    std::fs::create_dir(root.join("known")).unwrap();
    symlink(root.join("known"), root.join("known_too")).unwrap();
    symlink(&outside, root.join("ignored")).unwrap();
    std::fs::write(root.join(IGNORE_FILE), "ignored/\n").unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.scan_all(true);
    let mut said = words(&root, &told);
    said.sort();
    assert_eq!(said, ["unseen a.xodr", "unseen loop", "unseen maps"]);
    scanner.scan_all(false);
    assert!(words(&root, &told).is_empty());
    std::fs::remove_file(root.join("maps")).unwrap();
    scanner.scan_all(false);
    assert_eq!(words(&root, &told), ["seen again maps"]);
}

#[test]
fn unseen_directory_link_is_reported_once() {
    let ((_dir, root), (_other, outside)) = (farm(), farm());
    symlink(&outside, root.join("maps")).unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.scan_all(true);
    assert_eq!(words(&root, &told), ["unseen maps"]);
    scanner.look(&root.join("maps"));
    assert!(words(&root, &told).is_empty());
}

#[test]
fn file_of_the_first_scan_is_present_before_settling() {
    let (_dir, root) = farm();
    std::fs::write(root.join("young.xodr"), "").unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.scan_all(true);
    assert_eq!(words(&root, &told), ["present young.xodr"]);
    settle(&mut scanner);
    assert_eq!(words(&root, &told), ["settled young.xodr"]);
    std::fs::write(root.join("new.xodr"), "").unwrap();
    scanner.scan_all(false);
    assert!(words(&root, &told).is_empty());
}

#[test]
fn directory_replaced_by_a_link_loses_its_files() {
    let ((_dir, root), (_other, outside)) = (farm(), farm());
    for directory in [&root, &outside] {
        std::fs::create_dir(directory.join("maps")).unwrap();
        std::fs::write(directory.join("maps/a.xodr"), "").unwrap();
    }
    let (mut scanner, told) = scanner(&root);
    scanner.look(&root.join("maps/a.xodr"));
    assert_eq!(words(&root, &told), ["settled maps/a.xodr"]);
    std::fs::remove_dir_all(root.join("maps")).unwrap();
    symlink(outside.join("maps"), root.join("maps")).unwrap();
    scanner.scan_all(false);
    let said = ["vanished maps/a.xodr", "unseen maps"];
    assert_eq!(words(&root, &told), said);
}

fn vanished(told: &Receiver<Seen>) -> Vec<PathBuf> {
    let path = |seen| match seen {
        Seen::Vanished(path) => Some(path.to_path_buf()),
        _ => None,
    };
    told.try_iter().filter_map(path).collect()
}

#[test]
fn inaccessible_file_does_not_count_as_removed() {
    let dir = tempfile::tempdir().unwrap();
    let (below, aside) = (dir.path().join("maps"), dir.path().join("aside.d"));
    std::fs::create_dir(&below).unwrap();
    std::fs::write(below.join("a.xodr"), "").unwrap();
    let (mut scanner, told) = scanner(dir.path());
    scanner.look(&below.join("a.xodr"));
    // Root may read every directory, but a link to itself cannot be followed by anyone.
    std::fs::rename(&below, &aside).unwrap();
    symlink(&below, &below).unwrap();
    scanner.scan_all(false);
    assert_eq!(vanished(&told), Vec::<PathBuf>::new());
    std::fs::remove_file(&below).unwrap();
    scanner.scan_all(false);
    assert_eq!(vanished(&told), [below.join("a.xodr")]);
}

#[test]
fn full_scan_reads_the_ignore_rules_again() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.xodr");
    std::fs::write(&file, "").unwrap();
    let (mut scanner, told) = scanner(dir.path());
    scanner.look(&file);
    scanner.scan_all(false);
    assert_eq!(vanished(&told), Vec::<PathBuf>::new());
    std::fs::write(dir.path().join(IGNORE_FILE), "*.xodr\n").unwrap();
    scanner.scan_all(false);
    assert_eq!(vanished(&told), [file]);
}

#[test]
fn unsettled_file_that_is_removed_is_reported() {
    let (_dir, root) = farm();
    let file = root.join("a.xodr");
    std::fs::write(&file, "half of").unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.scan_all(true);
    assert_eq!(words(&root, &told), ["present a.xodr"]);
    std::fs::remove_file(&file).unwrap();
    scanner.scan_all(false);
    assert_eq!(words(&root, &told), ["vanished a.xodr"]);
}

#[test]
fn file_missed_by_the_broker_is_reported_again() {
    let (_dir, root) = farm();
    let file = root.join("a.xodr");
    let (mut scanner, told) = scanner(&root);
    std::fs::write(&file, "one").unwrap();
    scanner.look(&file);
    assert_eq!(words(&root, &told), ["settled a.xodr"]);
    // The file was away for a moment while the broker tried to read it.
    scanner.forget(&file);
    let may_be_written_to = ["present a.xodr"];
    assert_eq!(words(&root, &told), may_be_written_to);
    settle(&mut scanner);
    assert_eq!(words(&root, &told), ["settled a.xodr"]);
    std::fs::remove_file(&file).unwrap();
    scanner.forget(&file);
    scanner.scan_all(false);
    assert!(
        words(&root, &told).is_empty(),
        "the removal is already known"
    );
}

#[test]
fn ignored_dependency_is_only_reported_as_changed() {
    let (_dir, root) = farm();
    let (ignored, map) = (root.join(IGNORE_FILE), root.join("map.xodr"));
    std::fs::write(&ignored, "map.xodr\n").unwrap();
    std::fs::write(&map, "one").unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.dependencies.add(vec![(map.as_path().into(), None)]);
    scanner.look(&map);
    let said: Vec<Seen> = told.try_iter().collect();
    assert!(matches!(said[..], [Seen::Touched(..)]), "{said:?}");
}

#[test]
fn requested_scan_reports_a_present_or_removed_file() {
    let (_dir, root) = farm();
    let path = root.join("a.xodr");
    std::fs::write(&path, "one").unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.scan_all(true);
    settle(&mut scanner);
    words(&root, &told);
    // The file was away and came back between two events.
    scanner.look(&path);
    assert_eq!(words(&root, &told), ["settled a.xodr"]);
    std::fs::remove_file(&path).unwrap();
    scanner.look(&path);
    assert_eq!(words(&root, &told), ["vanished a.xodr"]);
    scanner.look(&path);
    assert!(words(&root, &told).is_empty());
}

#[test]
fn file_without_events_is_reported_when_it_is_closed() {
    let (_dir, root) = farm();
    let path = root.join("a.xodr");
    let writer = std::fs::File::create(&path).unwrap();
    let (mut scanner, told) = scanner(&root);
    scanner.scan_all(true);
    assert_eq!(words(&root, &told), ["present a.xodr"]);
    for ask in [false, true] {
        if ask {
            scanner.look_again(&path);
        }
        settle(&mut scanner);
    }
    assert_eq!(words(&root, &told), ["unfinished a.xodr"]);
    drop(writer);
    scanner.look_at_what_may_have_settled(Instant::now() + QUIET * 20);
    assert_eq!(words(&root, &told), ["settled a.xodr"]);
}

#[test]
fn removed_unfinished_file_is_reported() {
    let (_dir, root) = farm();
    let path = root.join("a.xodr");
    let (mut scanner, told) = scanner(&root);
    let _writer = std::fs::File::create(&path).unwrap();
    scanner.look_again(&path);
    settle(&mut scanner);
    let said = ["present a.xodr", "unfinished a.xodr"];
    assert_eq!(words(&root, &told), said);
    std::fs::remove_file(&path).unwrap();
    scanner.look(&path);
    assert_eq!(words(&root, &told), ["vanished a.xodr"]);
}
