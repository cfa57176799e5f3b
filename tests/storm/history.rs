//! The history of a storm: all observations from outside, with their times. It is recorded during
//! the storm and judged afterwards. A wrong acceptance counts even if it was corrected later.

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use qcbus_control::ask_broker;
use qcbus_messages::Verdict;
use qcbus_messages::control::{PeerStatus, Request, Response, Status};

use super::ledger;
use super::strain;
use super::verdicts::JUDGE;
use crate::support::cli::files_below;
use crate::support::dice::Dice;
use crate::support::farm::Farm;
use crate::support::reports::torn;
use crate::support::watchdog::pause;

/// An observation.
#[derive(Debug, Clone)]
pub struct Seen {
    /// Earliest possible time: the last look before it, or the time of the request.
    pub from: Duration,
    /// Time of the observation.
    pub at: Duration,
    pub what: What,
}

/// Kind of observation.
#[derive(Debug, Clone)]
pub enum What {
    /// A verdict file.
    Told(Box<Told>),
    /// An incomplete report.
    TornReport(String),
    /// A file behind the gate.
    Published { name: String, digest: String },
    /// An answer to `qcbus wait`.
    Answer {
        name: String,
        verdict: Verdict,
        digest: String,
    },
    /// The custom bundle is among the required bundles.
    Demanded,
    /// The broker has ended a session and killed its process, for this reason.
    Killed { name: String, why: String },
    /// A small work of the watchers, and the time that it took. It shows how slow the machine is.
    Worked { took: Duration },
}

/// A verdict file.
#[derive(Debug, Clone)]
pub struct Told {
    pub name: String,
    pub verdict: String,
    pub digest: String,
    /// Path and digest. The digest is `None` for a missing file.
    pub depends_on: Vec<(String, Option<String>)>,
    /// Bundles that took part.
    pub bundles: Vec<String>,
    /// Bundles with a checker that failed.
    pub failed: Vec<String>,
    /// Required bundles. `None` if the broker does not report them.
    pub demanded: Option<Vec<String>>,
    /// Epoch of the verdict.
    pub epoch: Option<u64>,
}

impl Told {
    fn read(name: &str, bytes: &[u8]) -> Option<Told> {
        let json: serde_json::Value = serde_json::from_slice(bytes).ok()?;
        let text = |value: &serde_json::Value| value.as_str().map(str::to_owned);
        let names = |list: &str, field: &str| -> Vec<String> {
            let list = json[list].as_array().into_iter().flatten();
            list.filter_map(|it| text(&it[field])).collect()
        };
        let depends_on = json["depends_on"].as_array().into_iter().flatten();
        // The list has names, or objects with a name and further data.
        let demanded = |it: &serde_json::Value| text(it).or_else(|| text(&it["name"]));
        Some(Told {
            name: name.to_owned(),
            verdict: text(&json["verdict"])?,
            digest: text(&json["sha256"])?,
            depends_on: depends_on
                .filter_map(|it| Some((text(&it["path"])?, text(&it["sha256"]))))
                .collect(),
            bundles: names("bundles", "name"),
            failed: names("failed", "bundle"),
            demanded: json["demanded"]
                .as_array()
                .map(|list| list.iter().filter_map(demanded).collect()),
            epoch: json["epoch"].as_u64(),
        })
    }
}

/// Threads that observe the farm during the storm.
#[derive(Debug)]
pub struct Watchers {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    start: Instant,
    over: AtomicBool,
    seen: Mutex<Vec<Seen>>,
    root: PathBuf,
    out: PathBuf,
    gate: PathBuf,
    instance: PathBuf,
}

impl Shared {
    fn seen(&self) -> MutexGuard<'_, Vec<Seen>> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn saw(&self, from: Duration, what: What) {
        let at = self.start.elapsed();
        self.seen().push(Seen { from, at, what });
    }

    fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }
}

impl Watchers {
    /// Starts the observation. All times are relative to `start`.
    pub fn start(farm: &Farm, start: Instant, seed: u64) -> Watchers {
        let shared = Arc::new(Shared {
            start,
            over: AtomicBool::new(false),
            seen: Mutex::default(),
            root: farm.root(),
            out: farm.out(),
            gate: farm.gate(),
            instance: farm.instance(),
        });
        let scanner = shared.clone();
        let asker = shared.clone();
        let worker = shared.clone();
        let threads = vec![
            std::thread::spawn(move || look(&scanner)),
            std::thread::spawn(move || ask(&asker, Dice::new(seed))),
            std::thread::spawn(move || work(&worker)),
        ];
        Watchers { shared, threads }
    }

    /// Ends the observation and returns all observations in order.
    pub fn end(mut self) -> Vec<Seen> {
        self.stop();
        std::mem::take(&mut self.shared.seen())
    }

    fn stop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

impl Drop for Watchers {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Interval between two looks at the results and the gate.
const LOOK: Duration = Duration::from_millis(10);
/// Number of looks between two looks at the reports.
const LOOK_AT_REPORTS: u32 = 50;
/// Number of looks between two status requests to the broker.
const ASK_STATUS: u32 = 10;

/// Suffix of verdict files. Their inodes are ignored, because the storm replaces the state by a
/// copy, and a copied verdict is not a new one.
const VERDICTS: &str = ".verdict.json";

/// Files seen before, with the metadata that would show a change.
type Marks = BTreeMap<PathBuf, (u64, i64, i64, u64)>;

fn look(shared: &Shared) {
    let (mut results, mut gate) = (Marks::new(), Marks::new());
    let (mut from, mut round) = (Duration::ZERO, 0);
    let mut told: Vec<(String, String)> = Vec::new();
    // In these formats, an incomplete report can be distinguished from a complete one.
    let documents = [".sarif", ".junit.xml", ".html"];
    let mut reports = documents.map(|suffix| (suffix, Marks::new()));
    while !shared.is_over() {
        let begun = shared.start.elapsed();
        for (name, bytes) in changed(&shared.out, &mut results, VERDICTS) {
            if let Some(told) = Told::read(&name, &bytes) {
                shared.saw(from, What::Told(Box::new(told)));
            }
        }
        for (name, bytes) in changed(&shared.gate, &mut gate, "") {
            let digest = ledger::digest(&bytes);
            shared.saw(from, What::Published { name, digest });
        }
        if round % LOOK_AT_REPORTS == 0 {
            for (suffix, marks) in &mut reports {
                for (file, bytes) in changed(&shared.out, marks, suffix) {
                    let name = format!("{file}{suffix}");
                    if let Some(why) = torn(&name, &bytes) {
                        shared.saw(from, What::TornReport(format!("{name}: {why}")));
                    }
                }
            }
        }
        if round % ASK_STATUS == 0
            && let Ok(Response::Status(status)) = ask_broker(&shared.instance, &Request::Status)
        {
            let wanted = |it: &PeerStatus| it.name == JUDGE && it.state != "draining";
            if status.peers.iter().any(wanted) {
                shared.saw(begun, What::Demanded);
            }
            for killed in killed(&status) {
                if !told.contains(&killed) {
                    let (name, why) = killed.clone();
                    shared.saw(from, What::Killed { name, why });
                    told.push(killed);
                }
            }
        }
        (from, round) = (begun, round + 1);
        pause(LOOK);
    }
}

/// Returns the peers that a broker has killed, and the reasons.
fn killed(status: &Status) -> Vec<(String, String)> {
    let killed = status.notices.iter().filter(|it| it.kind == "killed");
    let named = killed.filter_map(|it| Some((it.about.clone()?, it.text.clone())));
    named.collect()
}

/// Returns the files that changed since the last look: name without suffix, and bytes.
fn changed(directory: &Path, marks: &mut Marks, suffix: &str) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let mut now = Marks::new();
    for path in files_below(directory) {
        let name = path.to_string_lossy().into_owned();
        let temporary = path
            .file_name()
            .is_some_and(|it| it.to_string_lossy().starts_with('.'));
        let wanted = name.strip_suffix(suffix).filter(|_| !temporary);
        let Some((name, whole)) = wanted.map(|name| (name.to_owned(), directory.join(&path)))
        else {
            continue;
        };
        let Ok(is) = std::fs::metadata(&whole) else {
            continue;
        };
        let inode = if suffix == VERDICTS { 0 } else { is.ino() };
        let mark = (inode, is.mtime(), is.mtime_nsec(), is.size());
        let known = marks.get(&path) == Some(&mark);
        // A file that vanished during the look is looked for again.
        if let Ok(bytes) = (!known).then(|| std::fs::read(&whole)).transpose() {
            found.extend(bytes.map(|bytes| (name, bytes)));
            now.insert(path, mark);
        }
    }
    *marks = now;
    found
}

/// Asks for verdicts as a farm does, one file after another.
fn ask(shared: &Shared, mut dice: Dice) {
    while !shared.is_over() {
        let wait = dice.millis(60);
        pause(wait);
        let files = files_below(&shared.root);
        let Some(name) = dice
            .pick(&files)
            .map(|it| it.to_string_lossy().into_owned())
        else {
            continue;
        };
        let (from, file) = (shared.start.elapsed(), shared.root.join(&name));
        let timeout_ms = Some(1000);
        let answer = ask_broker(&shared.instance, &Request::Wait { file, timeout_ms });
        if let Ok(Response::Verdict(told)) = answer {
            let (verdict, digest) = (told.verdict, told.digest);
            shared.saw(
                from,
                What::Answer {
                    name,
                    verdict,
                    digest,
                },
            );
        }
    }
}

/// Repeats a small work, which shows how slow the machine is.
fn work(shared: &Shared) {
    while !shared.is_over() {
        pause(strain::PAUSE);
        let from = shared.start.elapsed();
        let took = strain::measure();
        shared.saw(from, What::Worked { took });
    }
}
