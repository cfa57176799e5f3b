//! Chaos: processes die at random, but every file gets exactly one complete verdict for its exact
//! bytes.
//!
//! `QCBUS_CHAOS_SECONDS` makes the storm longer (8 by default), `QCBUS_CHAOS_SEED` repeats one,
//! `QCBUS_MANY_FILES` sets how many files are dropped at once (1,500 by default).

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "this is all test code, including functions without `#[test]`"
)]

mod storm;
mod support;

use std::collections::BTreeSet;
use std::time::Instant;

use support::content::Content;
use support::dice::{Dice, seed};
use support::farm::{Farm, shm_segments, tail, zoo};
use support::inside::{is_inside, run_inside};
use support::judge::{Files, judge, verdicts_in_journal};
use support::processes::private_kib;
use support::watchdog::{until_or, until_so};

/// Command for a private shared memory that is small enough to be filled.
const SMALL_SHM: &str = "mount -t tmpfs -o size=512m tmpfs /dev/shm";

#[test]
fn nothing_is_lost_whatever_dies() {
    if is_inside() {
        return storm::rage(seed(), storm::seconds());
    }
    // The zoo is built first, because nothing is built inside.
    zoo();
    match run_inside(module_path!(), "nothing_is_lost_whatever_dies", SMALL_SHM) {
        Some(status) => assert!(status.success(), "see above"),
        // Without a private shared memory the storm does not fill it. The rest is the same.
        None => storm::rage(seed(), storm::seconds()),
    }
}

#[test]
fn broker_killed_under_load_loses_and_doubles_no_file() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let mut dice = Dice::new(seed());
    let files = drop_files(&farm, 400, &mut dice);
    for part in [50, 150, 250] {
        until_or(
            "some are judged",
            || (results(&farm) >= part).then_some(()),
            || farm.log(),
        );
        broker.kill();
        let before = results(&farm);
        let start = Instant::now();
        broker = farm.serve();
        until_or(
            "verdicts go on",
            || (results(&farm) > before).then_some(()),
            || farm.log(),
        );
        report(&format!(
            "killed under load with {before} results: the next came {} ms after the restart",
            start.elapsed().as_millis()
        ));
    }
    farm.settle(files.len());
    judge(&farm, &files, &[]).demand(&tail(&farm.log()));
    let doubled = verdicts_in_journal(&farm.journal());
    let doubled: Vec<_> = doubled.iter().filter(|(_, count)| **count != 1).collect();
    assert!(
        doubled.is_empty(),
        "no file may be judged twice: {doubled:#?}"
    );
    end(&farm, broker);
}

#[test]
fn memory_does_not_grow_with_the_number_of_files() {
    let many = number_from("QCBUS_MANY_FILES", 1500);
    let (few_kib, few) = (peak_with(many / 5), many / 5);
    let many_kib = peak_with(many);
    report(&format!(
        "private memory of the broker at its peak: {few_kib} KiB with {few} files, {many_kib} KiB with {many}"
    ));
    let entry = many_kib.saturating_sub(few_kib) * 1024 / (many - few);
    // This covers an entry of the files table with its path, stamps and verdict, twice because
    // vectors double. No other cost grows with the number of files.
    assert!(entry < 6 << 10, "{entry} bytes for each further file");
}

fn peak_with(count: u64) -> u64 {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    let mut dice = Dice::new(count);
    let start = Instant::now();
    let files = drop_files(&farm, count, &mut dice);
    let peak = peak_until_judged(&farm, broker.pid(), files.len());
    let seconds = start.elapsed().as_secs_f64();
    report(&format!(
        "{count} files at once: all judged in {seconds:.1} s"
    ));
    let judged: u64 = verdicts_in_journal(&farm.journal()).values().sum();
    assert_eq!(judged, count, "every file is judged once");
    judge(&farm, &files, &[]).demand(&tail(&farm.log()));
    end(&farm, broker);
    peak
}

/// Returns the maximum private memory of the broker in KiB until all files are judged. Its mappings
/// of the bus do not count, because the number of documents there is random.
fn peak_until_judged(farm: &Farm, broker: u32, total: usize) -> u64 {
    let total = u64::try_from(total).unwrap();
    let (mut done, mut peak) = (0, 0);
    while done < total {
        peak = peak.max(private_kib(broker).unwrap());
        let before = done;
        done = until_or(
            "one more verdict",
            || {
                farm.status()
                    .map(|it| it.files.judged)
                    .filter(|now| *now > before)
            },
            || format!("{:#?}\n{}", farm.status(), tail(&farm.log())),
        );
    }
    farm.settle(usize::try_from(total).unwrap());
    peak.max(private_kib(broker).unwrap())
}

fn drop_files(farm: &Farm, count: u64, dice: &mut Dice) -> Files {
    let named = (0..count).map(|at| (format!("{at}.xodr"), Content::any(dice)));
    let files: Files = named.collect();
    for (name, content) in &files {
        farm.write(name, &content.bytes());
    }
    files
}

fn results(farm: &Farm) -> usize {
    let Ok(entries) = std::fs::read_dir(farm.out()) else {
        return 0;
    };
    let names = entries.flatten().map(|entry| entry.file_name());
    names
        .filter(|name| name.to_string_lossy().ends_with(".xqar"))
        .count()
}

/// Stops the broker and asserts that it leaves nothing behind.
fn end(farm: &Farm, mut broker: support::broker::Broker) {
    let prefix = farm.shm_prefix();
    let down = farm.qcbus(&["down"]);
    assert!(down.status.success(), "{down:?}\n{}", tail(&farm.log()));
    assert!(broker.wait().success());
    until_or(
        "all processes have ended",
        || farm.processes().is_empty().then_some(()),
        || format!("{:#?}\n{}", farm.processes(), tail(&farm.log())),
    );
    let guests = farm.base().join("guests");
    let of_modules = || support::processes::all_with(&guests.to_string_lossy());
    until_or(
        "all that modules have started has ended",
        || of_modules().is_empty().then_some(()),
        || format!("{:#?}\n{}", of_modules(), tail(&farm.log())),
    );
    until_so("no shared memory is left", || {
        shm_segments(&prefix).is_empty()
    });
    let left: BTreeSet<String> = std::fs::read_dir(farm.instance())
        .map(|entries| {
            entries
                .flatten()
                .map(|it| it.file_name().to_string_lossy().into_owned())
        })
        .map(Iterator::collect)
        .unwrap_or_default();
    assert!(
        left.is_empty(),
        "nothing may remain in the runtime directory: {left:?}"
    );
}

fn number_from(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable)
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(otherwise)
}

#[expect(
    clippy::print_stderr,
    reason = "the figures are for the person who runs the test"
)]
fn report(text: &str) {
    eprintln!("{text}");
}
