//! Tests that an on-demand check leaves nothing in the broker.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use qcbus_messages::Verdict;
use rusqlite::Connection;
use rustix::process::Signal;

use super::bench::{Bench, Made, signal};
use crate::support::broker::Broker;
use crate::support::cli::files_below;
use crate::support::content::Content;
use crate::support::watchdog::{until_or, until_so};

/// Returns all files below a directory except the journal, which is written at other times.
fn tree(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = files_below(directory).into_iter();
    let files = files.filter(|file| !file.to_string_lossy().contains("journal"));
    let read = |file: PathBuf| {
        let bytes = std::fs::read(directory.join(&file)).unwrap();
        (file, bytes)
    };
    files.map(read).collect()
}

/// Returns the number of lines in the history.
fn history(bench: &Bench) -> i64 {
    let journal = Connection::open(bench.farm.journal()).unwrap();
    let count = journal.query_row("SELECT count(*) FROM jobs", [], |row| row.get(0));
    count.unwrap()
}

#[test]
fn on_demand_check_changes_no_state_and_publishes_nothing() {
    let mut bench = Bench::new();
    let gate = bench.farm.gate();
    let arguments = ["--gate", gate.to_str().unwrap(), "--report", "json"];
    bench.farm.arguments.extend(arguments.map(str::to_owned));
    let _broker = bench.farm.serve_ready();
    let good = bench.watched("good.xodr", Content::Good(1).bytes());
    let bad = bench.watched("bad.xodr", Content::NoHeader(2).bytes());
    let before = bench.farm.settle(2).files;
    until_so("it is published and reported", || {
        let reported = |name: &str| bench.farm.out().join(name).exists();
        let all = reported("bad.xodr.json") && reported("good.xodr.json");
        gate.join("good.xodr").exists() && all
    });
    let trees = || [bench.farm.out(), gate.clone()].map(|it| tree(&it));
    let (kept, lines) = (trees(), history(&bench));
    let beside = bench.beside("beside.xodr", Content::Good(3).bytes());
    let beside_bad = bench.beside("beside_bad.xodr", Content::NoHeader(4).bytes());
    for _ in 0..3 {
        for file in [&good, &bad, &beside, &beside_bad] {
            assert_eq!(bench.compared(&[file]), Made::Warm);
        }
    }
    let status = bench.farm.settle(2);
    assert_eq!(status.files, before);
    assert_eq!((trees(), history(&bench)), (kept, lines));
    // A file that was checked on demand is still judged when it appears in the farm.
    std::fs::copy(&beside, bench.farm.root().join("came.xodr")).unwrap();
    assert_eq!(bench.farm.verdict("came.xodr").verdict, Verdict::Accepted);
}

#[test]
fn on_demand_check_leaves_no_directory_behind() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    let file = bench.beside("map.xodr", Content::Good(1).bytes());
    let directories = || {
        let entries = std::fs::read_dir(bench.cli.path().join(".run/qcbus"));
        let entries = entries.into_iter().flatten().flatten();
        let names = entries.map(|it| it.file_name());
        names.collect::<std::collections::BTreeSet<_>>()
    };
    // A check without a broker removes the leftovers of other checks.
    bench.cold(&[&file]);
    let before = directories();
    let (made, _) = bench.told(bench.command(&[&file, "-v"]));
    assert_eq!(made, Made::Warm);
    assert_eq!(directories(), before);
}

#[test]
fn watched_file_checked_on_demand_keeps_its_own_verdict() {
    let bench = Bench::new();
    let _broker = bench.farm.serve_ready();
    for round in 0..4 {
        let content = match round % 2 {
            0 => Content::NoHeader(round),
            _ => Content::Good(round),
        };
        let bundle = bench.stop_maps();
        let file = bench.watched("map.xodr", content.bytes());
        bench.until_under_way();
        let words = [file.as_str(), "-v"];
        let asked = std::thread::scope(|scope| {
            let asked = scope.spawn(|| bench.told(bench.command(&words)));
            // The bundle now has both jobs: the watched file and the on-demand check.
            bench.peer("xodrBundle", |it| it.active > 1);
            signal(&bundle, Signal::CONT);
            asked.join().unwrap()
        });
        assert_eq!(asked, (Made::Warm, bench.cold(&words)));
        assert_eq!(bench.farm.verdict("map.xodr").verdict, content.verdict());
        bench.farm.settle(1);
    }
    std::fs::remove_file(bench.farm.root().join("map.xodr")).unwrap();
    bench.farm.settle(0);
}

/// Checks that were started but are not waited for.
struct Asked(Vec<Child>);

impl Asked {
    fn by(bench: &Bench, file: &str, many: usize) -> Asked {
        let one = |number| {
            let out = format!("out{number}");
            let mut command = bench.command_into(&out, &[file]);
            command.current_dir(bench.cli.path());
            command.env("XDG_RUNTIME_DIR", bench.cli.path().join(".run"));
            let quiet = command.stdout(Stdio::null()).stderr(Stdio::null());
            quiet.spawn().unwrap()
        };
        Asked((0..many).map(one).collect())
    }

    fn vanish(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Drop for Asked {
    fn drop(&mut self) {
        self.vanish();
    }
}

fn descriptors(broker: &Broker) -> usize {
    let path = format!("/proc/{}/fd", broker.pid());
    std::fs::read_dir(path).unwrap().count()
}

#[test]
fn vanished_clients_leave_nothing_behind() {
    let bench = Bench::new();
    let broker = bench.farm.serve_ready();
    let file = bench.beside("map.xodr", Content::Good(1).bytes());
    bench.compared(&[&file]);
    bench.until_quiet();
    let before = descriptors(&broker);
    for _ in 0..3 {
        let bundle = bench.stop_maps();
        let mut asked = Asked::by(&bench, &file, 30);
        until_or(
            "they have asked",
            || {
                let queue = bench.farm.status()?.queue;
                (queue.waiting + queue.active >= 30).then_some(())
            },
            || format!("{:#?}", bench.farm.status()),
        );
        asked.vanish();
        // The bundle is still stopped, but no request waits for it any more.
        bench.until_quiet();
        signal(&bundle, Signal::CONT);
        assert_eq!(bench.compared(&[&file]), Made::Warm);
    }
    until_or(
        "nothing is left of those who have gone",
        || (descriptors(&broker) < before + 16).then_some(()),
        || format!("{before} before, {} now", descriptors(&broker)),
    );
}
