//! Bundles join and leave while the broker runs: the next result has their checkers, or not.

use std::process::{Child, Command, Stdio};

use crate::support::content::Content;
use crate::support::farm::{Farm, tail, zoo};
use crate::support::processes::signal_pid;
use crate::support::watchdog::{until, until_or};
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;
use rustix::process::Signal;

const POLITE: [&str; 2] = [
    "check_polite_root_has_children",
    "check_polite_no_blank_values",
];

/// A bundle that was started by hand. It is killed at the end of the test.
struct StartedManually(Child);

impl StartedManually {
    /// Runs `qcbus bundle run PROGRAM ARGUMENTS`, as a person types it.
    fn start(farm: &Farm, animal: &[&str]) -> StartedManually {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.args(["bundle", "run"]).arg(zoo()).args(animal);
        command.arg("--instance-dir").arg(farm.instance());
        let quiet = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        StartedManually(quiet.spawn().unwrap())
    }

    fn signal(&self, signal: Signal) {
        signal_pid(i32::try_from(self.0.id()).unwrap(), signal);
    }

    fn ends(&mut self) -> Option<i32> {
        until("the bundle ends", || self.0.try_wait().unwrap()).code()
    }
}

impl Drop for StartedManually {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Writes a file and returns the checkers of a bundle in its result.
fn checkers_of(farm: &Farm, bundle: &str, number: u64) -> Vec<String> {
    let name = format!("{number}.xodr");
    farm.write(&name, &Content::Good(number).bytes());
    assert_eq!(farm.verdict(&name).verdict, Verdict::Accepted);
    let results = farm.result(&name);
    let mut ids = Vec::new();
    for bundle in results.bundles.iter().filter(|it| it.name == bundle) {
        for checker in &bundle.checkers {
            assert_eq!(checker.status, Some(Status::Completed), "{}", checker.id);
            ids.push(checker.id.to_string());
        }
    }
    ids
}

fn wait_for_state(farm: &Farm, bundle: &str, ready: bool) {
    let is_ready = || {
        let peers = farm.status().unwrap().peers;
        peers
            .iter()
            .any(|it| it.name == bundle && (it.state == "ready" || it.state == "busy"))
    };
    let what = format!("{bundle} is ready: {ready}");
    until_or(
        &what,
        || (is_ready() == ready).then_some(()),
        || {
            format!(
                "{:#?}\n{}",
                farm.status().map(|it| it.peers),
                tail(&farm.log())
            )
        },
    );
}

#[test]
fn manually_started_bundle_joins_and_leaves_at_a_signal() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    let generation = farm.status().unwrap().generation;
    assert_eq!(checkers_of(&farm, "polite", 1), [""; 0]);
    for round in 1..4 {
        let mut bundle = StartedManually::start(&farm, &["polite"]);
        wait_for_state(&farm, "polite", true);
        assert_eq!(checkers_of(&farm, "polite", round * 10), POLITE);
        bundle.signal(Signal::TERM);
        assert_eq!(bundle.ends(), Some(0), "the bundle leaves in order");
        wait_for_state(&farm, "polite", false);
        assert_eq!(checkers_of(&farm, "polite", round * 10 + 1), [""; 0]);
    }
    let status = farm.status().unwrap();
    assert_eq!(
        (status.pid, status.generation),
        (broker.pid(), generation),
        "the broker was not restarted"
    );
}

#[test]
fn interrupted_bundle_leaves_cleanly() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let mut bundle = StartedManually::start(&farm, &["polite", "--name", "second"]);
    wait_for_state(&farm, "second", true);
    assert_eq!(checkers_of(&farm, "second", 1), POLITE);
    bundle.signal(Signal::INT);
    assert_eq!(bundle.ends(), Some(0));
    wait_for_state(&farm, "second", false);
    assert_eq!(checkers_of(&farm, "second", 2), [""; 0]);
}

#[test]
fn bundle_add_and_remove_work_for_a_supervised_bundle() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let zoo = zoo();
    let edit = |arguments: &[&str]| {
        let said = farm.qcbus(&[&["bundle"], arguments].concat());
        assert!(
            said.status.success(),
            "{}",
            String::from_utf8_lossy(&said.stderr)
        );
    };
    edit(&["add", "polite", &zoo.to_string_lossy(), "polite"]);
    wait_for_state(&farm, "polite", true);
    assert_eq!(checkers_of(&farm, "polite", 1), POLITE);
    let listed = farm.qcbus(&["bundle", "list"]);
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    assert!(
        listed.lines().any(|line| line.starts_with("polite")),
        "{listed}"
    );
    edit(&["remove", "polite"]);
    wait_for_state(&farm, "polite", false);
    assert_eq!(checkers_of(&farm, "polite", 2), [""; 0]);
    until("its process has ended", || {
        let processes = farm.processes();
        let left = processes.iter().any(|it| it.words[0].ends_with("/zoo"));
        (!left).then_some(())
    });
}

#[test]
fn lost_manually_started_bundle_is_removed_by_name() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let bundle = StartedManually::start(&farm, &["polite"]);
    wait_for_state(&farm, "polite", true);
    bundle.signal(Signal::KILL);
    wait_for_state(&farm, "polite", false);
    let remove = || farm.qcbus(&["bundle", "remove", "polite"]);
    let said = remove();
    let text = String::from_utf8_lossy(&said.stderr).into_owned();
    assert_eq!(said.status.code(), Some(0), "{text}");
    let status = farm.status().unwrap();
    let left = status.peers.iter().any(|peer| peer.name == "polite");
    assert!(!left, "{status:#?}");
    assert_eq!(checkers_of(&farm, "polite", 1), [""; 0]);
    assert_eq!(remove().status.code(), Some(2));
}

#[test]
fn earlier_files_are_judged_again_with_a_new_bundle() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    checkers_of(&farm, "polite", 1);
    let mut bundle = StartedManually::start(&farm, &["polite"]);
    let has = |expected: usize| {
        until_or(
            "the old file is judged again",
            || {
                let results = farm.result("1.xodr");
                let polite = results.bundles.iter().find(|it| it.name == "polite");
                let checkers = polite.map_or(0, |it| it.checkers.len());
                (checkers == expected).then_some(())
            },
            || tail(&farm.log()),
        );
    };
    has(2);
    bundle.signal(Signal::TERM);
    bundle.ends();
    has(0);
}
