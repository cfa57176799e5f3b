//! Tests that play hundreds of schedules.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use qcbus_bus::{Host, HostOptions, Instance};

use super::schedule::{Figures, Stage, Wrong, play};
use super::threads::Crew;

/// Number of schedules in a test run.
const SCHEDULES: u64 = 150;

fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is not a number: {text}")),
    )
}

/// Creates a directory in memory, if possible.
fn directory() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = tempfile::Builder::new()
        .prefix("qcbus-sim-")
        .tempdir_in(memory);
    made.or_else(|_| tempfile::tempdir()).unwrap()
}

/// Calls `body` with a stage for schedules, on which a bus carries the images.
fn on_stage<T>(body: impl FnOnce(&Stage) -> T) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    let runtime = runtime.unwrap();
    let _inside = runtime.enter();
    let dir = directory();
    let real = std::fs::canonicalize(dir.path()).unwrap();
    let instance = Instance::at(real.join("bus"));
    let host = Host::start(&instance, HostOptions::default()).unwrap();
    let stage = Stage {
        crew: Arc::new(Crew::default()),
        documents: host.documents(),
        dir: real,
    };
    body(&stage)
}

fn report(seed: u64, wrong: &Wrong) -> String {
    let last = wrong.lines.len().saturating_sub(60);
    let lines = wrong.lines[last..].join("\n");
    format!(
        "schedule {seed}: {}\n(QCBUS_SIM_SEED={seed} prints all of it; its end:)\n{lines}",
        wrong.what
    )
}

#[test]
fn all_parts_agree_after_any_event_order() {
    if let Some(seed) = number("QCBUS_SIM_SEED") {
        let played = on_stage(|stage| play(stage, seed, true));
        let (lines, what) = match played {
            Ok((_, lines)) => (lines, None),
            Err(wrong) => (wrong.lines, Some(wrong.what)),
        };
        println!("{}", lines.join("\n"));
        assert_eq!(what, None, "schedule {seed}");
        return;
    }
    let from = number("QCBUS_SIM_FROM").unwrap_or(1);
    let count = number("QCBUS_SIM_SCHEDULES").unwrap_or(SCHEDULES);
    println!("schedules {from} to {}", from + count - 1);
    let (next, failed) = (AtomicU64::new(from), AtomicBool::new(false));
    let begin = Instant::now();
    let threads = std::thread::available_parallelism().map_or(1, Into::into);
    let one = || on_stage(|stage| play_many(stage, &next, from + count, &failed));
    let all: Vec<Result<Figures, String>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(one)).collect();
        threads.into_iter().map(|it| it.join().unwrap()).collect()
    });
    let took = begin.elapsed();
    let mut sum = Figures::default();
    for figures in all {
        match figures {
            Ok(figures) => sum.add(figures),
            Err(text) => panic!("{text}"),
        }
    }
    println!("{count} schedules in {took:.1?}: {sum:?}");
    assert!(
        sum.stored as u64 > count,
        "too few results were stored: {sum:?}"
    );
    assert!(
        sum.kills > count / 2,
        "too few brokers were killed: {sum:?}"
    );
}

impl Figures {
    fn add(&mut self, other: Figures) {
        self.steps += other.steps;
        self.kills += other.kills;
        self.stored += other.stored;
        self.virtual_seconds += other.virtual_seconds;
    }
}

fn play_many(
    stage: &Stage,
    next: &AtomicU64,
    end: u64,
    failed: &AtomicBool,
) -> Result<Figures, String> {
    let mut sum = Figures::default();
    while !failed.load(Ordering::Relaxed) {
        let seed = next.fetch_add(1, Ordering::Relaxed);
        if seed >= end {
            break;
        }
        match play(stage, seed, false) {
            Ok((figures, _)) => sum.add(figures),
            Err(wrong) => {
                failed.store(true, Ordering::Relaxed);
                // The schedule is played again with its lines recorded.
                let written = play(stage, seed, true).err();
                return Err(report(seed, &written.unwrap_or(wrong)));
            }
        }
    }
    Ok(sum)
}

#[test]
fn seed_gives_same_schedule_every_time() {
    on_stage(|stage| {
        for seed in 1..20 {
            let once = play(stage, seed, true).map_err(|it| it.what).unwrap();
            let again = play(stage, seed, true).map_err(|it| it.what).unwrap();
            let differs = once
                .1
                .iter()
                .zip(&again.1)
                .position(|(one, other)| one != other);
            let at = differs.unwrap_or(0);
            let (one, other) = (once.1.get(at), again.1.get(at));
            assert!(
                differs.is_none(),
                "seed {seed}, line {at}: {one:?} differs from {other:?}"
            );
        }
    });
}
