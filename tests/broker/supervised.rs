//! Tests a broker under a service manager, in a terminal and with other users.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::processes::ProcessKind;
use crate::support::programs::copy_program;
use crate::support::watchdog::{until_or, until_so};
use qcbus_control::ask_broker;
use qcbus_messages::Verdict;
use qcbus_messages::control::Request;
use rustix::process::{Pid, Signal, kill_process_group};

/// Starts a broker in a process group of its own, as a shell does.
fn serve_as_a_job(farm: &Farm) -> Broker {
    let mut command = farm.serve_command();
    Broker::start(command.process_group(0), &farm.log_path())
}

/// Sends SIGHUP to the process group of the broker, as a closing terminal does.
fn hang_up(broker: &Broker) {
    let group = Pid::from_raw(broker.pid().cast_signed()).unwrap();
    kill_process_group(group, Signal::HUP).unwrap();
}

fn until_it_answers(farm: &Farm) {
    let answers = || farm.status().map(drop);
    until_or("the broker answers", answers, || tail(&farm.log()));
}

fn until_reloaded(farm: &Farm, times: usize) {
    let reloaded = || farm.log().matches("SIGHUP: ").count();
    let is_enough = || (reloaded() >= times).then_some(());
    until_or("it reloads", is_enough, || tail(&farm.log()));
}

fn bundles(farm: &Farm) -> Vec<i32> {
    let all = farm.processes().into_iter();
    let bundles = all.filter(|it| it.kind() == ProcessKind::Bundle);
    bundles.map(|it| it.pid).collect()
}

#[test]
fn hangup_reloads_without_ending_broker_or_bundles() {
    let farm = Farm::new();
    let mut broker = serve_as_a_job(&farm);
    until_it_answers(&farm);
    farm.write("first.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("first.xodr").verdict, Verdict::Accepted);
    let before = bundles(&farm);
    hang_up(&broker);
    until_reloaded(&farm, 1);
    farm.write("second.xodr", &Content::Good(2).bytes());
    assert_eq!(farm.verdict("second.xodr").verdict, Verdict::Accepted);
    assert_eq!(bundles(&farm), before);
    broker.signal(Signal::TERM);
    assert_eq!(broker.wait().code(), Some(0), "{}", tail(&farm.log()));
}

/// Checks whether a process has a handler for SIGHUP.
fn catches_hangup(pid: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mut lines = status.lines();
    let mask = lines.find_map(|line| line.strip_prefix("SigCgt:"));
    mask.is_some_and(|it| u64::from_str_radix(it.trim(), 16).unwrap() & 1 == 1)
}

#[test]
fn hangup_during_the_start_does_not_end_it() {
    let farm = Farm::new();
    let mut broker = serve_as_a_job(&farm);
    until_so("it listens to SIGHUP", || catches_hangup(broker.pid()));
    hang_up(&broker);
    until_it_answers(&farm);
    until_reloaded(&farm, 1);
    assert!(broker.is_alive());
}

#[test]
fn closed_log_does_not_end_the_broker() {
    let farm = Farm::new();
    let (log, reader) = UnixStream::pair().unwrap();
    drop(reader);
    let mut command = farm.serve_command();
    command.stdin(Stdio::null()).stdout(Stdio::null());
    let log = Stdio::from(std::os::fd::OwnedFd::from(log));
    let mut broker = command.stderr(log).spawn().unwrap();
    until_it_answers(&farm);
    farm.write("bad.xodr", &Content::NoHeader(1).bytes());
    assert_eq!(farm.verdict("bad.xodr").verdict, Verdict::Rejected);
    assert!(broker.try_wait().unwrap().is_none());
    broker.kill().unwrap();
    broker.wait().unwrap();
}

/// User id of a user without any files.
const NOBODY: u32 = 65534;

/// Runs a command as another user. Returns `None` if the test must not change the user.
fn as_nobody(program: &Path, arguments: &[&str]) -> Option<Output> {
    if !rustix::process::geteuid().is_root() {
        eprintln!("SKIPPED: only root can be another user");
        return None;
    }
    let mut command = Command::new(program);
    command.args(arguments).uid(NOBODY).gid(NOBODY);
    command.env_remove("XDG_RUNTIME_DIR");
    Some(command.output().unwrap())
}

fn status_for_nobody(program: &Path, instance: &Path) -> Option<Output> {
    let instance = instance.to_str().unwrap();
    as_nobody(program, &["status", "--instance-dir", instance])
}

/// Returns a farm that other users can read, with a copy of the program that they can run.
fn open_farm() -> (Farm, PathBuf) {
    let farm = Farm::new();
    std::fs::set_permissions(farm.base(), Permissions::from_mode(0o755)).unwrap();
    let program = farm.base().join("qcbus");
    copy_program(Path::new(env!("CARGO_BIN_EXE_qcbus")), &program);
    (farm, program)
}

#[test]
fn other_user_learns_the_owner_of_the_broker() {
    let (farm, program) = open_farm();
    let _broker = farm.serve();
    until_it_answers(&farm);
    let directory = farm.instance();
    let Some(said) = status_for_nobody(&program, &directory) else {
        return;
    };
    let why = String::from_utf8(said.stderr).unwrap();
    assert_eq!(said.status.code(), Some(4), "{why}");
    assert!(why.contains("it belongs to user `root` (uid 0)"), "{why}");
    assert!(!why.contains("no broker"), "{why}");
    let missing = farm.base().join("nothing");
    let said = status_for_nobody(&program, &missing).unwrap();
    let why = String::from_utf8(said.stderr).unwrap();
    assert_eq!(said.status.code(), Some(4), "{why}");
    assert!(why.contains("no broker serves this instance"), "{why}");
}

#[test]
fn user_without_broker_learns_of_another_users_broker() {
    let (farm, program) = open_farm();
    // The name distinguishes this broker from those of other tests.
    let name = format!("test-{}", std::process::id());
    let directory = farm.base().join(&name);
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    command
        .arg("serve")
        .arg(farm.root())
        .arg("--out")
        .arg(farm.out());
    command.arg("--instance-dir").arg(&directory);
    let mut broker = Broker::start(&mut command, &farm.log_path());
    until_so("the broker answers", || {
        ask_broker(&directory, &Request::Status).is_ok()
    });
    let said = as_nobody(&program, &["status", "--instance", &name]);
    let of_root = format!("process {} of user `root` (uid 0)", broker.pid());
    broker.signal(Signal::TERM);
    broker.wait();
    let Some(said) = said else { return };
    let why = String::from_utf8(said.stderr).unwrap();
    assert_eq!(said.status.code(), Some(4), "{why}");
    assert!(why.contains(&of_root), "{why}");
}

/// Returns the exit code and the output of `status --health`.
fn health(farm: &Farm) -> (Option<i32>, String) {
    let said = farm.qcbus(&["status", "--health"]);
    (said.status.code(), String::from_utf8(said.stdout).unwrap())
}

fn until_health(farm: &Farm, wanted: i32, reason: &str) {
    let is_so = || {
        let (code, text) = health(farm);
        (code == Some(wanted) && text.contains(reason)).then_some(())
    };
    let explain = || format!("{:?}\n{}", health(farm), tail(&farm.log()));
    until_or(reason, is_so, explain);
}

#[test]
fn health_is_an_exit_code_with_reasons() {
    let farm = Farm::with(&["--max-restarts", "1"]);
    assert_eq!(health(&farm), (Some(4), String::new()));
    let _broker = farm.serve_ready();
    until_health(&farm, 0, "healthy\n");
    farm.let_in("dies_on_every_job", "");
    farm.write("a.xodr", &Content::Good(1).bytes());
    until_health(&farm, 1, "\nbundle dies_on_every_job ");
    let plain = farm.qcbus(&["status"]);
    assert_eq!(plain.status.code(), Some(0));
    farm.send_away("dies_on_every_job");
    until_health(&farm, 0, "healthy\n");
}

#[test]
fn missing_watched_directory_is_unhealthy() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let aside = farm.base().join("aside");
    std::fs::rename(farm.root(), &aside).unwrap();
    until_health(&farm, 1, "farm: is gone\n");
    std::fs::rename(&aside, farm.root()).unwrap();
    until_health(&farm, 0, "healthy\n");
}

#[test]
fn configuration_not_in_force_is_unhealthy() {
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    let good = "<Config><CheckerBundle application=\"xodrBundle\"/></Config>";
    std::fs::write(&config, good).unwrap();
    farm.arguments
        .extend(["-c".to_owned(), config.to_str().unwrap().to_owned()]);
    let _broker = farm.serve_ready();
    until_health(&farm, 0, "healthy\n");
    std::fs::write(&config, "<Config>").unwrap();
    until_health(&farm, 1, "the configuration on disk is not in force");
    std::fs::write(&config, good).unwrap();
    until_health(&farm, 0, "healthy\n");
}

#[test]
fn missing_required_bundle_is_unhealthy() {
    let mut farm = Farm::new();
    let config = farm.base().join("config.xml");
    let names = |second: &str| {
        let bundle = |name: &str| format!("<CheckerBundle application=\"{name}\"/>");
        format!(
            "<Config>{}{}</Config>",
            bundle("xodrBundle"),
            bundle(second)
        )
    };
    std::fs::write(&config, names("xoscBundle")).unwrap();
    let option = ["-c".to_owned(), config.to_str().unwrap().to_owned()];
    farm.arguments.extend(option);
    let _broker = farm.serve_ready();
    until_health(&farm, 0, "healthy\n");
    std::fs::write(&config, names("nixBundle")).unwrap();
    until_health(&farm, 1, "requires nixBundle, which has not joined\n");
}

#[test]
fn stopped_broker_is_unhealthy() {
    let farm = Farm::new();
    let broker = farm.serve_ready();
    broker.signal(Signal::STOP);
    let (code, _) = health(&farm);
    broker.signal(Signal::CONT);
    assert_eq!(code, Some(1));
}

#[test]
fn missing_report_is_unhealthy() {
    let farm = Farm::with(&["--report", "text"]);
    let _broker = farm.serve_ready();
    let obstacle = farm.out().join("a.xodr.txt/obstacle");
    std::fs::create_dir_all(&obstacle).unwrap();
    farm.write("a.xodr", &Content::Good(1).bytes());
    until_health(&farm, 1, " cannot report: 1 not reported: ");
    std::fs::remove_dir_all(obstacle.parent().unwrap()).unwrap();
    until_health(&farm, 0, "healthy\n");
}

#[test]
fn doctor_inspects_the_running_broker() {
    let mut farm = Farm::new();
    let state = farm.base().join("state");
    let gate = farm.gate();
    for (option, path) in [("--state", &state), ("--gate", &gate)] {
        let path = path.to_str().unwrap().to_owned();
        farm.arguments.extend([option.to_owned(), path]);
    }
    let told = |farm: &Farm| String::from_utf8(farm.qcbus(&["doctor"]).stdout).unwrap();
    let journal = format!("{}/journal.sqlite", state.display());
    let without = told(&farm);
    assert!(
        without.contains("no broker runs as this instance"),
        "{without}"
    );
    assert!(
        without.contains("/qcbus-out/.qcbus/journal.sqlite"),
        "{without}"
    );
    let _broker = farm.serve_ready();
    let with = told(&farm);
    for wanted in [
        &journal,
        gate.to_str().unwrap(),
        farm.out().to_str().unwrap(),
    ] {
        assert!(with.contains(wanted), "{wanted}\n{with}");
    }
    assert!(!with.contains("qcbus-out"), "{with}");
}

#[test]
fn doctor_asks_the_broker_for_its_temporary_directory() {
    let farm = Farm::new();
    // No user can create this directory, not even root.
    let blocked = farm.base().join("file/tmp");
    std::fs::write(farm.base().join("file"), "").unwrap();
    let mut command = farm.serve_command();
    let mut broker = Broker::start(command.env("TMPDIR", &blocked), &farm.log_path());
    let scratch = || farm.status()?.scratch;
    let told = until_or("it has looked", scratch, || tail(&farm.log()));
    assert!(told.directory.starts_with(&blocked), "{told:?}");
    let doctor = || String::from_utf8(farm.qcbus(&["doctor"]).stdout).unwrap();
    let said = doctor();
    assert!(said.contains("FIX  temporary files"), "{said}");
    assert!(said.contains("Not a directory"), "{said}");
    assert!(said.contains("start the broker with TMPDIR set"), "{said}");
    broker.kill();
    let _broker = farm.serve();
    until_or("it has looked", scratch, || tail(&farm.log()));
    let said = doctor();
    assert!(said.contains("ok   temporary files"), "{said}");
}

/// The private directories of ASAM modules are below `TMPDIR`.
#[test]
fn service_may_write_to_its_temporary_directory() {
    let unit = include_str!("../../docs/qcbus.service");
    let says = |line: &str| unit.lines().any(|it| it == line);
    assert!(
        says("ProtectSystem=strict"),
        "/tmp is read-only without this"
    );
    assert!(says("PrivateTmp=yes"), "{unit}");
}
