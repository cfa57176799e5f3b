//! Tests that a large map is on the bus only once, and that every bundle reads it in place.

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, Command, Stdio};

use crate::support::content::Content;
use crate::support::farm::{Farm, tail, zoo};
use crate::support::watchdog::{until, until_or};
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;
use rustix::process::Signal;

const MIB: u64 = 1 << 20;

/// Size of the map.
const MAP: u64 = 100 * MIB;

/// Maximum private memory of a bundle: its program, its stacks and its findings.
const PRIVATE: u64 = 24 * MIB;

/// A bundle that was started manually. It is killed with the test.
struct StartedManually(Child);

impl StartedManually {
    fn start(farm: &Farm, animal: &[&str]) -> StartedManually {
        let mut command = Command::new(zoo());
        command
            .args(animal)
            .arg("--instance-dir")
            .arg(farm.instance());
        let quiet = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        StartedManually(quiet.spawn().unwrap())
    }
}

impl Drop for StartedManually {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Returns the ready bundles and their process ids, once all of these are ready.
fn bundles(farm: &Farm, names: &[&str]) -> BTreeMap<String, u32> {
    until_or(
        "all bundles are ready",
        || {
            let peers = farm.status()?.peers.into_iter();
            let ready = peers.filter(|it| it.state == "ready" && names.contains(&it.name.as_str()));
            let ready: BTreeMap<_, _> = ready.map(|it| (it.name, it.pid)).collect();
            (ready.len() == names.len()).then_some(ready)
        },
        || tail(&farm.log()),
    )
}

/// Memory of a process, in bytes.
#[derive(Debug, Default, Clone, Copy)]
struct Memory {
    /// Private pages outside shared memory.
    private: u64,
    /// Mapped shared memory.
    mapped: u64,
    /// Shared memory that the process has touched.
    touched: u64,
}

/// Returns the memory of a process according to `smaps`, or `None` if the process has ended.
fn memory(pid: u32) -> Option<Memory> {
    let smaps = std::fs::read_to_string(format!("/proc/{pid}/smaps")).ok()?;
    let (mut memory, mut shared) = (Memory::default(), false);
    for line in smaps.lines() {
        let mut words = line.split_whitespace();
        let (Some(first), Some(second)) = (words.next(), words.next()) else {
            continue;
        };
        if !first.ends_with(':') {
            shared = line.contains("/dev/shm/");
            continue;
        }
        let bytes = second.parse::<u64>().unwrap_or(0) << 10;
        match (first, shared) {
            ("Private_Clean:" | "Private_Dirty:", false) => memory.private += bytes,
            ("Size:", true) => memory.mapped += bytes,
            ("Rss:", true) => memory.touched += bytes,
            _ => {}
        }
    }
    Some(memory)
}

impl Memory {
    fn max(self, other: Memory) -> Memory {
        Memory {
            private: self.private.max(other.private),
            mapped: self.mapped.max(other.mapped),
            touched: self.touched.max(other.touched),
        }
    }
}

/// Returns a valid map of this size: one road with a lot of user data.
fn large_map(bytes: u64) -> Vec<u8> {
    let text = String::from_utf8(Content::Good(1).bytes()).unwrap();
    let (head, end) = text.split_at(text.find("</road>").unwrap());
    let mut large = head.to_owned();
    let value = "0123456789 ".repeat(40);
    while large.len() < usize::try_from(bytes).unwrap() {
        large.push_str(&format!("<userData code=\"survey\" value=\"{value}\"/>\n"));
    }
    large.push_str(end);
    large.into_bytes()
}

#[test]
fn four_bundles_read_one_image() {
    let farm = Farm::with(&["--job-deadline", "10m", "--silence-limit", "5m"]);
    let broker = farm.serve_ready();
    let more: Vec<StartedManually> = ["one", "two", "three"]
        .iter()
        .map(|name| StartedManually::start(&farm, &["polite", "--name", name]))
        .collect();
    let pids = bundles(&farm, &["xodrBundle", "one", "two", "three"]);
    let map = large_map(MAP);
    let size = u64::try_from(map.len()).unwrap();
    farm.write("large.xodr", &map);
    drop(map);
    let mut peak: BTreeMap<&str, Memory> = BTreeMap::new();
    until_or(
        "the map is judged",
        || {
            for (name, pid) in &pids {
                let peak = peak.entry(name).or_default();
                *peak = peak.max(memory(*pid)?);
            }
            farm.status().filter(|it| it.files.judged == 1).map(|_| ())
        },
        || format!("{:#?}\n{}", farm.status(), tail(&farm.log())),
    );
    for (name, memory) in &peak {
        let Memory {
            private,
            mapped,
            touched,
        } = *memory;
        eprintln!(
            "{name}: {:.1} MiB private, {} MiB shared memory mapped, {} MiB of it touched",
            private as f64 / MIB as f64,
            mapped / MIB,
            touched / MIB
        );
        assert!(private < PRIVATE, "{name} must not have a copy: {memory:?}");
        let whole = touched * 10 > size * 9;
        assert!(whole, "{name} must read the shared image: {memory:?}");
    }
    assert_eq!(
        farm.verdict("large.xodr").verdict,
        Verdict::Accepted,
        "{:#?}",
        farm.verdict_file("large.xodr")
    );
    let results = farm.result("large.xodr");
    let names: Vec<&str> = results.bundles.iter().map(|it| it.name.as_str()).collect();
    for name in pids.keys() {
        assert!(
            names.contains(&name.as_str()),
            "{name} must take part: {names:?}"
        );
    }
    drop((more, broker));
}

#[test]
fn process_writing_to_the_image_dies_alone() {
    let farm = Farm::new();
    let mut broker = farm.serve_ready();
    let _polite = StartedManually::start(&farm, &["polite"]);
    let mut offender = StartedManually::start(&farm, &["writes_to_the_image"]);
    let others = bundles(&farm, &["xodrBundle", "xoscBundle", "polite"]);
    bundles(&farm, &["writes_to_the_image"]);
    farm.write("bad.xodr", &Content::NoHeader(1).bytes());
    let end = until("the offender ends", || offender.0.try_wait().unwrap());
    assert_eq!(end.signal(), Some(Signal::SEGV.as_raw()), "{end:?}");
    // The findings of the other bundles in the same image are not affected.
    assert_eq!(farm.verdict("bad.xodr").verdict, Verdict::Rejected);
    let results = farm.result("bad.xodr");
    for bundle in &results.bundles {
        for checker in &bundle.checkers {
            let failed = checker.status == Some(Status::Error);
            assert_eq!(
                failed,
                bundle.name == "writes_to_the_image",
                "{}: {}",
                checker.id,
                checker.summary
            );
        }
    }
    let missing = "check_asam_xodr_xml_fileheader_is_present";
    let mut checkers = results.bundles.iter().flat_map(|it| &it.checkers);
    assert_eq!(
        checkers.find(|it| *it.id == *missing).unwrap().issues.len(),
        1
    );
    assert!(broker.is_alive());
    assert_eq!(
        bundles(&farm, &["xodrBundle", "xoscBundle", "polite"]),
        others,
        "no other process died"
    );
}
