//! Bundles that exceed their task, inside the sandbox and without it.

#![allow(
    missing_docs,
    reason = "this is all test code, including functions without `#[test]`"
)]

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::farm::{Farm, tail, zoo};
use crate::support::inside::skip;
use crate::support::judge::{Files, judge};
use crate::support::watchdog::{until, until_or};
use qcbus_messages::Verdict;
use qcbus_messages::control::SandboxStatus;

/// Checks whether Landlock is missing. Then the test is skipped with a message.
fn landlock_is_missing() -> bool {
    let missing = qcbus_confine::kernel_level() == 0;
    if missing {
        skip(
            "a bundle that is confined",
            "this kernel does not support Landlock",
        );
    }
    missing
}

fn sandbox_of(farm: &Farm, bundle: &str) -> SandboxStatus {
    until_or(
        "its sandbox is told",
        || {
            let mut peers = farm.status()?.peers.into_iter();
            let found = peers.find(|it| it.name == bundle && it.checkers > 0)?;
            found.sandbox
        },
        || tail(&farm.log()),
    )
}

fn line_of(farm: &Farm, bundle: &str) -> String {
    let said = farm.qcbus(&["status"]);
    let text = String::from_utf8(said.stdout).unwrap();
    let mut lines = text.lines();
    let line = lines.find(|it| it.contains(bundle));
    line.unwrap_or_else(|| panic!("{text}")).to_owned()
}

/// Waits for this output of the animal, which needs a job for it, and returns the log.
fn words(farm: &Farm, what: &str) -> String {
    until_or(
        "the animal has had a job",
        || farm.log().contains(what).then(|| farm.log()),
        || tail(&farm.log()),
    )
}

fn sound_files(farm: &Farm) -> Files {
    let mut files = Files::new();
    for number in 0..30 {
        let (name, content) = (format!("{number}.xodr"), Content::Good(number));
        farm.write(&name, &content.bytes());
        files.insert(name, content);
    }
    files
}

#[test]
fn confined_bundle_cannot_write_to_files_of_others() {
    if landlock_is_missing() {
        return;
    }
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    farm.let_in("scribbles_on_others", "");
    sandbox_of(&farm, "scribbles_on_others");
    let files = sound_files(&farm);
    farm.settle(files.len());
    for name in files.keys() {
        assert_eq!(farm.verdict(name).verdict, Verdict::Accepted, "{name}");
    }
    judge(&farm, &files, &[]).demand(&tail(&farm.log()));
    let log = words(&farm, "it saw ");
    let said: Vec<&str> = log.lines().filter(|it| it.contains("it saw ")).collect();
    assert!(
        said.iter().all(|it| it.contains("opened 0 for writing")),
        "{said:#?}"
    );
    assert!(
        said.iter().any(|it| !it.contains("it saw 0,")),
        "the bundle must see something: {said:#?}"
    );
}

#[test]
fn unconfined_bundle_can_write_and_status_reports_it() {
    let farm = Farm::with(&["--no-sandbox"]);
    let _broker = farm.serve_ready();
    farm.let_in("scribbles_on_others", "");
    for bundle in ["scribbles_on_others", "xodrBundle"] {
        let sandbox = sandbox_of(&farm, bundle);
        assert_eq!(
            (sandbox.state.as_str(), sandbox.why.as_str()),
            ("open", "--no-sandbox")
        );
        assert!(line_of(&farm, bundle).contains(", not confined: --no-sandbox"));
    }
    farm.write("a.xodr", &Content::Good(1).bytes());
    let log = words(&farm, "it saw ");
    let said = log.lines().find(|it| it.contains("it saw ")).unwrap();
    assert!(!said.contains("opened 0 for writing"), "{said}");
}

#[test]
fn standard_bundles_are_reported_as_confined() {
    if landlock_is_missing() {
        return;
    }
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    for bundle in ["xodrBundle", "xoscBundle", "modularBundle"] {
        let sandbox = sandbox_of(&farm, bundle);
        assert_eq!(
            (sandbox.state.as_str(), sandbox.why.as_str()),
            ("confined", "")
        );
        assert!(
            line_of(&farm, bundle).contains(", confined"),
            "{}",
            line_of(&farm, bundle)
        );
    }
}

/// Targets of the animal.
struct Victims {
    file: PathBuf,
    listener: TcpListener,
    process: Child,
    /// Sleep time of the processes that the animal starts. The test finds them by it.
    sleep: String,
}

impl Victims {
    fn new(farm: &Farm) -> Victims {
        let process = Command::new("sleep")
            .arg("1000")
            .stdin(Stdio::null())
            .spawn();
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        listener.set_nonblocking(true).unwrap();
        let process = process.unwrap();
        Victims {
            file: farm.base().join("meddled"),
            sleep: format!("4000.{}", process.id()),
            listener,
            process,
        }
    }

    /// Returns the command line of the animal with its targets. The shell splits it.
    fn animal(&self) -> PathBuf {
        let port = self.listener.local_addr().unwrap().port();
        let (file, victim, sleep) = (self.file.display(), self.process.id(), &self.sleep);
        PathBuf::from(format!(
            "env ZOO_FILE={file} ZOO_PORT={port} ZOO_VICTIM={victim} ZOO_SLEEP={sleep} {}",
            zoo().display()
        ))
    }

    fn lives(&mut self) -> bool {
        self.process.try_wait().unwrap().is_none()
    }

    /// Counts the processes that the animal has started, in whatever session they are.
    fn sleepers(&self) -> usize {
        let entries = std::fs::read_dir("/proc").unwrap().flatten();
        let lines = entries.filter_map(|it| std::fs::read(it.path().join("cmdline")).ok());
        let words = format!("sleep\0{}\0", self.sleep);
        lines.filter(|line| line == words.as_bytes()).count()
    }
}

impl Drop for Victims {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn with_a_meddler(
    arguments: &[&str],
    may: Option<serde_json::Value>,
) -> (Farm, Broker, Victims, String) {
    let farm = Farm::with(arguments);
    let broker = farm.serve_ready();
    let victims = Victims::new(&farm);
    match may {
        None => farm.let_in_by(&victims.animal(), "meddles", ""),
        Some(may) => declare(&farm, &victims.animal(), &may),
    }
    sandbox_of(&farm, "meddles");
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    let log = words(&farm, "it has tried everything");
    (farm, broker, victims, log)
}

/// Adds a manifest with declared permissions.
fn declare(farm: &Farm, program: &Path, may: &serde_json::Value) {
    let manifest = serde_json::json!({ "module": [{
        "name": "meddles",
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": format!("{} meddles", program.display()),
        "mode": "bus",
        "may": may,
    }]});
    let unfinished = farm.bundles_d().join(".meddles");
    std::fs::write(&unfinished, manifest.to_string()).unwrap();
    std::fs::rename(&unfinished, farm.bundles_d().join("meddles.json")).unwrap();
}

fn meddlings(log: &str) -> Vec<&str> {
    let mut said: Vec<&str> = log
        .lines()
        .filter_map(|line| line.split("it meddled: ").nth(1))
        .collect();
    said.sort_unstable();
    said.dedup();
    said
}

#[test]
fn confined_bundle_cannot_affect_other_processes() {
    if landlock_is_missing() {
        return;
    }
    let (_farm, _broker, mut victims, log) = with_a_meddler(&[], None);
    assert_eq!(meddlings(&log), Vec::<&str>::new());
    assert!(!victims.file.exists());
    assert!(victims.lives());
    assert!(
        victims.listener.accept().is_err(),
        "no process has connected"
    );
    assert_eq!(victims.sleepers(), 0);
}

#[test]
fn only_access_declared_in_a_manifest_is_allowed() {
    if landlock_is_missing() {
        return;
    }
    let may = serde_json::json!({ "read": ["/etc/passwd"], "network": true });
    let (_farm, _broker, mut victims, log) = with_a_meddler(&[], Some(may));
    assert_eq!(
        meddlings(&log),
        ["connected", "read a file", "sent a datagram"]
    );
    assert!(victims.lives() && !victims.file.exists());
}

#[test]
fn descendants_of_a_bundle_end_with_the_broker() {
    let (farm, _broker, victims, log) = with_a_meddler(&["--no-sandbox"], None);
    let all = meddlings(&log);
    assert_eq!(all.len(), 7, "every action is possible: {all:?}");
    until("what it has started sleeps", || {
        (victims.sleepers() > 0).then_some(())
    });
    assert!(farm.qcbus(&["down"]).status.success());
    assert_eq!(victims.sleepers(), 0);
}

#[test]
fn descendants_of_a_bundle_end_with_it() {
    let (farm, _broker, victims, _) = with_a_meddler(&["--no-sandbox"], None);
    until("what it has started sleeps", || {
        (victims.sleepers() > 0).then_some(())
    });
    farm.send_away("meddles");
    until("it goes", || (victims.sleepers() == 0).then_some(()));
}
