//! Measures the time of the rules on maps, from the image of the document.
//!
//! `cargo bench -p qcbus-xodr --bench rule_times -- [--rules] [--runs N] [--threads N] $PWD/MAP.xodr…`
//! prints the time of all rules together per map. With one thread (the default) it is CPU time,
//! with more threads it is wall-clock time. `--rules` prints the wall-clock time of each rule (the
//! minimum of all runs) for each map, sorted by the last map. `tests/xodr_speed.py` makes large
//! maps for measurements.

#![expect(clippy::print_stdout, reason = "it prints its measurements")]

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use qcbus_sdk::{Issue, Listener, Loaded, Outcome, Permits, Plan, check_with};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (mut rules, mut runs, mut threads, mut maps) = (false, 5, 1, Vec::new());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--rules" => rules = true,
            "--runs" => runs = arguments.next().unwrap_or_default().parse()?,
            "--threads" => threads = arguments.next().unwrap_or_default().parse()?,
            "--bench" => {} // cargo adds it
            _ => maps.push(argument),
        }
    }
    let measured: Vec<Measured> = maps
        .iter()
        .map(|map| measure(map, runs, &Permits::new(threads)))
        .collect::<Result<_, _>>()?;
    for (map, measured) in maps.iter().zip(&measured) {
        let [best, median] = [measured.best, measured.median].map(milliseconds);
        println!(
            "{best:9.3} ms best {median:9.3} ms median  {} issues  {map}",
            measured.issues
        );
    }
    if rules {
        by_rule(&measured);
    }
    Ok(())
}

fn by_rule(measured: &[Measured]) {
    let Some(last) = measured.last() else { return };
    let mut rules: Vec<(&String, &Duration)> = last.rules.iter().collect();
    rules.sort_by_key(|(_, took)| std::cmp::Reverse(**took));
    for (id, _) in rules {
        for map in measured {
            print!(
                "{:9.3} ",
                map.rules.get(id).copied().map_or(0.0, milliseconds)
            );
        }
        println!(" {id}");
    }
}

fn milliseconds(took: Duration) -> f64 {
    took.as_secs_f64() * 1e3
}

/// Measurements of one map.
struct Measured {
    /// Minimum time of all rules together.
    best: Duration,
    median: Duration,
    /// Minimum time of each rule.
    rules: BTreeMap<String, Duration>,
    issues: usize,
}

fn measure(
    map: &str,
    runs: usize,
    permits: &Permits,
) -> Result<Measured, Box<dyn std::error::Error>> {
    let path = Path::new(map);
    let loaded = Loaded::from_path(path, path.parent().unwrap_or(path))?;
    let plan = Plan::by_default(&qcbus_xodr::BUNDLE);
    let mut rules: BTreeMap<String, Duration> = BTreeMap::new();
    let (mut totals, mut issues) = (Vec::new(), 0);
    for _ in 0..runs.max(1) {
        // A bundle also creates a new subject for each run, so that cached data is not reused.
        let before = clock(permits);
        let subject = loaded.subject(&qcbus_xodr::BUNDLE)?;
        let mut times = Times::default();
        check_with(&plan, &subject, permits, &mut times);
        totals.push(clock(permits).saturating_sub(before));
        issues = times.issues;
        for (checker, took) in times.took {
            let slot = rules.entry(plan.checkers()[checker].id.clone());
            let slot = slot.or_insert(took);
            *slot = took.min(*slot);
        }
    }
    totals.sort_unstable();
    Ok(Measured {
        best: totals[0],
        median: totals[totals.len() / 2],
        rules,
        issues,
    })
}

/// Returns the CPU time of this thread if it is the only one, otherwise the wall-clock time.
fn clock(permits: &Permits) -> Duration {
    let clock = match permits.count() {
        1 => libc::CLOCK_THREAD_CPUTIME_ID,
        _ => libc::CLOCK_MONOTONIC,
    };
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    #[expect(unsafe_code, reason = "std has no clock for the CPU time of a thread")]
    // SAFETY: `time` is a timespec that outlives the call.
    unsafe {
        libc::clock_gettime(clock, &raw mut time);
    }
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    Duration::from_secs(seconds) + Duration::from_nanos(u64::try_from(time.tv_nsec).unwrap_or(0))
}

/// The times that the checkers report.
#[derive(Default)]
struct Times {
    took: Vec<(usize, Duration)>,
    issues: usize,
}

impl Listener for Times {
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome) {
        self.took.push((checker, outcome.took));
        self.issues += issues.len();
    }
}
