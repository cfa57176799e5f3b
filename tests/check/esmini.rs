//! Real scenarios are played by another simulator: events that never start on paper never start there.
//!
//! `QCBUS_ESMINI` names the program of esmini, `QCBUS_SCENARIOS` a directory with a directory for each
//! repository, both absolute. The test prints a table: see `docs/evidence/played-scenarios.md`.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde_json::Value;

use crate::support::cli::{Cli, files_below};
use crate::support::inside::skip;

const ESMINI: &str = "QCBUS_ESMINI";
const SCENARIOS: &str = "QCBUS_SCENARIOS";

/// Cases that people reported, if they are at hand.
const REPORTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases/reports");

/// Seconds of wall time for one run. A run without an end plays hours of simulation time meanwhile.
const LIMIT: &str = "8";

/// Step of the simulator, in seconds.
const STEP: &str = "0.05";

/// Tolerance of bounds, in seconds: a few steps.
const SLACK: f64 = 0.2;

/// A run: the start of each name in seconds, and the time of the last line of the log.
#[derive(Debug, Default, PartialEq)]
struct Run {
    starts: BTreeMap<String, f64>,
    last: f64,
}

/// Reads a log such as `[2.050] [info] brake standbyState -> startTransition -> runningState`.
fn read_log(log: &str) -> Run {
    let mut run = Run::default();
    for line in log.lines() {
        let time = line.strip_prefix('[').and_then(|it| it.split_once("] ["));
        let Some((Ok(time), text)) = time.map(|(time, text)| (time.parse::<f64>(), text)) else {
            continue;
        };
        run.last = run.last.max(time);
        let starts = text.strip_suffix(" -> startTransition -> runningState");
        let name = starts.and_then(|it| it.split_once("] ")?.1.rsplit_once(' '));
        if let Some((name, _)) = name {
            run.starts.entry(name.to_owned()).or_insert(time);
        }
    }
    run
}

/// Returns the earliest and the latest first start for the name of each event; infinity means never.
/// The log has no paths, so the bounds hold for all elements of that name.
fn bounds(timeline: &Value) -> BTreeMap<&str, (f64, f64)> {
    let elements = timeline["elements"].as_array().unwrap();
    let first = |name: &str, bound: &str| {
        let named = elements.iter().filter(|it| it["name"] == name);
        let times = named.filter_map(|it| it["tolerant"]["start"][bound].as_f64());
        times.fold(f64::INFINITY, f64::min)
    };
    let events = elements.iter().filter(|it| it["kind"] == "event");
    let names = events.filter_map(|it| it["name"].as_str());
    names
        .map(|name| (name, (first(name, "earliest"), first(name, "latest"))))
        .collect()
}

/// Counts and differences.
#[derive(Debug, Default)]
struct Tally {
    /// Scenarios, played ones, names of events, names that started, names that never start on paper.
    counts: [usize; 5],
    /// Events that started although the paper says "never".
    wrong: Vec<String>,
    /// Other events that started outside of their bounds.
    outside: Vec<String>,
}

impl Tally {
    fn of(file: &Path, timeline: &Value, run: &Run) -> Tally {
        let mut tally = Tally::default();
        tally.counts[0] = 1;
        if run.starts.is_empty() {
            return tally;
        }
        tally.counts[1] = 1;
        for (name, (earliest, latest)) in bounds(timeline) {
            let start = run.starts.get(name).copied().unwrap_or(f64::INFINITY);
            let is_never = earliest == f64::INFINITY;
            tally.counts[2] += 1;
            tally.counts[3] += usize::from(start < f64::INFINITY);
            tally.counts[4] += usize::from(is_never);
            // A run that is over says nothing about later starts.
            let is_late = start.min(run.last) > latest + SLACK;
            if is_late || start < earliest - SLACK {
                let file = file.display();
                let text = format!("{file}: `{name}`: {start}, not {earliest} to {latest}");
                [&mut tally.outside, &mut tally.wrong][usize::from(is_never)].push(text);
            }
        }
        tally
    }

    fn add(&mut self, other: Tally) {
        for (sum, count) in self.counts.iter_mut().zip(other.counts) {
            *sum += count;
        }
        self.wrong.extend(other.wrong);
        self.outside.extend(other.outside);
    }

    fn row(&self, name: &dyn Display) -> String {
        let counts = self.counts.map(|it| it.to_string()).join(" | ");
        let (wrong, outside) = (self.wrong.len(), self.outside.len());
        format!("| {name} | {counts} | {wrong} | {outside} |")
    }
}

/// Plays a scenario until it ends, or until the limit.
fn play(esmini: &Path, scenario: &Path) -> Run {
    let cli = Cli::new();
    let mut command = Command::new("timeout");
    // Only an interrupted run writes the end of its log. A killed one does not.
    command.args(["--signal=INT", "--kill-after=5", LIMIT]);
    command.arg(esmini).arg("--osc").arg(scenario);
    command.args(["--headless", "--disable_stdout", "--fixed_timestep", STEP]);
    command.args(["--logfile_path", "log.txt"]);
    cli.run(&mut command);
    let log = std::fs::read(cli.path().join("log.txt")).unwrap_or_default();
    read_log(&String::from_utf8_lossy(&log))
}

/// Plays a scenario in both ways, unless the command shows no times for it.
fn compared(esmini: &Path, scenario: &Path) -> Option<Tally> {
    let said = Cli::new().qcbus(&["timeline", scenario.to_str()?, "--json"]);
    let timeline = (said.code == Some(0)).then(|| serde_json::from_str(&said.stdout).unwrap())?;
    Some(Tally::of(scenario, &timeline, &play(esmini, scenario)))
}

/// Plays all scenarios below a directory, several at once.
fn played(esmini: &Path, directory: &Path) -> Tally {
    let mut scenarios = files_below(directory);
    scenarios.retain(|it| it.extension().is_some_and(|it| it == "xosc"));
    let next = AtomicUsize::new(0);
    let all = Mutex::new(Tally::default());
    let work = || {
        while let Some(scenario) = scenarios.get(next.fetch_add(1, Ordering::Relaxed)) {
            let tally = compared(esmini, &directory.join(scenario)).unwrap_or_default();
            all.lock().unwrap().add(tally);
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    all.into_inner().unwrap()
}

#[test]
fn events_that_never_start_on_paper_never_start_in_esmini() {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let (Some(esmini), Some(root)) = (variable(ESMINI), variable(SCENARIOS)) else {
        return skip("esmini", &format!("{ESMINI} and {SCENARIOS} are not set"));
    };
    let mut all = Tally::default();
    for root in [root, REPORTED.into()] {
        let entries = std::fs::read_dir(root).into_iter().flatten().flatten();
        let mut directories: Vec<PathBuf> = entries.map(|it| it.path()).collect();
        directories.sort();
        for directory in directories {
            let tally = played(&esmini, &directory);
            println!("{}", tally.row(&directory.display()));
            all.add(tally);
        }
    }
    println!("{}", all.row(&"all"));
    println!("outside of the bounds: {:#?}", all.outside);
    assert!(all.counts[1] > 0, "{ESMINI} plays no scenario");
    assert!(all.wrong.is_empty(), "{:#?}", all.wrong);
}

#[test]
fn log_tells_starts_and_the_last_time() {
    let log = "\
[] [info] esmini GIT REV: 1
[0.000] [info] storyBoard initState -> initToStandby -> standbyState
[0.050] [info] cut in -> out standbyState -> startTransition -> runningState
[0.050] [warn] brake is late
[3.100] [info] cut in -> out runningState -> endTransition -> completeState
a line without time -> startTransition -> runningState
";
    let starts = BTreeMap::from([("cut in -> out".to_owned(), 0.05)]);
    assert_eq!(read_log(log), Run { starts, last: 3.1 });
}
