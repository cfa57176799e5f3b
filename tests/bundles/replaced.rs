//! Tests a program that is replaced on disk while a broker runs, as in a package upgrade.

use std::collections::BTreeMap;
use std::fs::Metadata;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::inside::{is_inside, run_inside};
use crate::support::judge::verdicts_in_journal;
use crate::support::processes::{Process, all_with, signal_pid};
use crate::support::programs::{copy_program, write_script};
use crate::support::watchdog::until_or;
use qcbus_messages::Verdict;
use rustix::process::Signal;

const MANNERS: &str = include_str!("../../bundles/asam-adapter/tests/modules/guests/manners.sh");
const FINDS: &str =
    r#"{ begin; checker one completed "$(issue 1 "wrong in $input")"; end; } > "$result""#;

/// Four bundles, one of them a hosted module, and a reporter.
const PEERS: usize = 5;

fn install(path: &Path, script: &str) {
    write_script(path, &format!("#!/bin/sh\n{script}\n"));
}

/// Returns a farm, the program of its broker, and another program to replace it.
fn farm() -> (Farm, PathBuf, PathBuf, Broker) {
    let farm = Farm::with(&["--report", "json"]);
    let base = farm.base();
    let [program, newer, guest] = ["qcbus", "newer", "guest"].map(|it| base.join(it));
    copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), &program);
    install(&newer, "echo \"the newer program: $*\" >&2\nexit 1");
    install(&guest, &format!("{MANNERS}\n{FINDS}"));
    std::fs::create_dir(base.join("tmp")).unwrap();
    let module = serde_json::json!({
        "name": "guest",
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": guest.to_str().unwrap(),
    });
    farm.let_in_module("guest", &module);
    let mut command = Command::new(&program);
    command.args(farm.serve_command().get_args());
    command.env("TMPDIR", base.join("tmp"));
    let broker = Broker::start(&mut command, &farm.log_path());
    (farm, program, newer, broker)
}

/// Returns the processes of all peers, once all are ready and none of them is in `before`.
fn ready_peers(farm: &Farm, before: &BTreeMap<String, u32>) -> BTreeMap<String, u32> {
    let look = || {
        let peers = farm.status()?.peers.into_iter();
        let ready = peers.filter(|it| ["ready", "busy"].contains(&it.state.as_str()));
        let ready: BTreeMap<String, u32> = ready.map(|it| (it.name, it.pid)).collect();
        let is_new = |(name, pid): (&String, &u32)| before.get(name) != Some(pid);
        (ready.len() == PEERS && ready.iter().all(is_new)).then_some(ready)
    };
    let explain = || format!("{:#?}\n{}", farm.status(), tail(&farm.log()));
    until_or("all peers are ready", look, explain)
}

fn program_of(pid: u32) -> (u64, u64) {
    let data: Metadata = std::fs::metadata(format!("/proc/{pid}/exe")).unwrap();
    (data.dev(), data.ino())
}

/// Kills all children after the program was replaced. They must then run the program of the broker
/// again.
fn children_stay_what_the_broker_is(replace: impl FnOnce(&Path, &Path)) {
    let (farm, program, newer, broker) = farm();
    let before = ready_peers(&farm, &BTreeMap::new());
    assert_eq!(farm.status().unwrap().replaced, None);
    replace(&program, &newer);
    for pid in before.values() {
        signal_pid(i32::try_from(*pid).unwrap(), Signal::KILL);
    }
    let after = ready_peers(&farm, &before);
    for (name, pid) in &after {
        assert_eq!(program_of(*pid), program_of(broker.pid()), "{name}");
        let words = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap();
        let called = words.split(|it| *it == 0).next().unwrap();
        assert_eq!(called, program.as_os_str().as_encoded_bytes(), "{name}");
        // A child may outlive the broker, so it writes to the log directly.
        let speaks_to = std::fs::read_link(format!("/proc/{pid}/fd/2")).unwrap();
        assert_eq!(speaks_to, farm.log_path(), "{name}");
        let listed = std::fs::read_to_string(format!("/proc/{pid}/comm")).unwrap();
        assert_eq!(listed, "qcbus\n", "{name}");
    }
    let runners = all_with("--runner").into_iter();
    let guest = farm.base().join("guest").display().to_string();
    let runners = runners.filter(|it| it.words.contains(&guest));
    let speaks_to = |it: Process| std::fs::read_link(format!("/proc/{}/fd/2", it.pid)).ok();
    let speak_to: Vec<PathBuf> = runners.filter_map(speaks_to).collect();
    assert!(!speak_to.is_empty() && speak_to.iter().all(|it| *it == farm.log_path()));
    farm.write("a.xodr", &Content::Good(1).bytes());
    let judged = farm.verdict("a.xodr").verdict;
    assert_eq!(
        judged,
        Verdict::Rejected,
        "judged by the module: {}",
        farm.log()
    );
    assert!(!farm.log().contains("the newer program"), "{}", farm.log());
    it_is_said(&farm, &program);
}

fn it_is_said(farm: &Farm, program: &Path) {
    let said = || farm.status()?.replaced;
    let said = until_or("it is said", said, || tail(&farm.log()));
    assert!(said.contains(program.to_str().unwrap()), "{said}");
    assert!(said.contains("restart the broker"), "{said}");
    let note = format!("note       {said}\n");
    for (command, line) in [
        ("status", note),
        ("doctor", format!("program            {said}\n")),
    ] {
        let told = farm.qcbus(&[command]);
        let told = String::from_utf8(told.stdout).unwrap();
        assert!(told.contains(&line), "{told}");
    }
}

#[test]
fn children_match_the_broker_after_a_rename() {
    children_stay_what_the_broker_is(|program, newer| std::fs::rename(newer, program).unwrap());
}

#[test]
fn children_match_the_broker_after_a_removal() {
    children_stay_what_the_broker_is(|program, _| std::fs::remove_file(program).unwrap());
}

#[test]
fn children_match_the_broker_behind_a_mount() {
    if !is_inside() {
        let name = "children_match_the_broker_behind_a_mount";
        let ended = run_inside(module_path!(), name, "true");
        assert!(ended.is_none_or(|it| it.success()));
        return;
    }
    children_stay_what_the_broker_is(|program, newer| {
        let mut mount = Command::new("mount");
        let mounted = mount.arg("--bind").args([newer, program]).status();
        assert!(mounted.unwrap().success());
    });
}

#[test]
fn changed_link_to_the_program_is_reported() {
    let farm = Farm::new();
    let [program, newer, link, aside] =
        ["qcbus-1", "qcbus-2", "qcbus", "aside"].map(|it| farm.base().join(it));
    for copy in [&program, &newer] {
        copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), copy);
    }
    std::os::unix::fs::symlink(&program, &link).unwrap();
    let mut command = Command::new(&link);
    command.args(farm.serve_command().get_args());
    let _broker = Broker::start(&mut command, &farm.log_path());
    until_or(
        "it answers",
        || farm.status().map(drop),
        || tail(&farm.log()),
    );
    std::os::unix::fs::symlink(&newer, &aside).unwrap();
    std::fs::rename(&aside, &link).unwrap();
    it_is_said(&farm, &link);
}

/// An upgrade may replace the program while it starts. The next broker must not check all files again.
#[test]
fn program_replaced_during_its_start_keeps_verdicts() {
    let farm = Farm::new();
    let program = farm.base().join("qcbus");
    let install = || copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), &program);
    let serve = |executed: &Path| {
        let mut command = Command::new(executed);
        command.arg0(&program).args(farm.serve_command().get_args());
        Broker::start(&mut command, &farm.log_path())
    };
    farm.write("a.xodr", &Content::Good(1).bytes());
    install();
    let opened = std::fs::File::open(&program).unwrap();
    std::fs::remove_file(&program).unwrap();
    let executed = format!("/proc/{}/fd/{}", std::process::id(), opened.as_raw_fd());
    let mut broker = serve(Path::new(&executed));
    farm.settle(1);
    let running = std::fs::read_link(format!("/proc/{}/exe", broker.pid())).unwrap();
    assert!(
        running.to_string_lossy().ends_with(" (deleted)"),
        "{running:?}"
    );
    broker.kill();
    install();
    let _broker = serve(&program);
    // The broker examines old verdicts before it checks a new file.
    farm.write("b.xodr", &Content::Good(2).bytes());
    farm.verdict("b.xodr");
    farm.settle(2);
    let verdicts = verdicts_in_journal(&farm.journal());
    assert_eq!(verdicts.values().sum::<u64>(), 2, "{verdicts:?}");
}
