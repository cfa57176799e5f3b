//! Tests files that another user of the host puts where a broker reads. They must not be run,
//! trusted or changed. The broker runs as root, which such a user hopes for, or as a user that a
//! third one wants to deceive.

use std::os::unix::fs::{PermissionsExt, chown, lchown, symlink};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::broker::Broker;
use crate::support::farm::Farm;
use crate::support::watchdog::{until_or, until_so};

/// User id of the hostile user.
const NEIGHBOUR: u32 = 12_345;
/// User id of a user who is not root.
const NOBODY: u32 = 65_534;

/// Checks whether the test can act as a hostile user.
fn is_root() -> bool {
    let is_root = rustix::process::geteuid().is_root();
    if !is_root {
        eprintln!("SKIPPED: only root can act as several users");
    }
    is_root
}

fn mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

fn give(path: &Path, user: u32) {
    chown(path, Some(user), Some(user)).unwrap();
}

/// Returns a manifest with a program that leaves a trace.
fn evil(trace: &Path) -> String {
    let command = format!("/bin/sh -c 'touch {}'", trace.display());
    manifest(&command)
}

fn manifest(command: &str) -> String {
    serde_json::json!({ "module": [{
        "name": "evil",
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": command,
        "mode": "bus",
    }]})
    .to_string()
}

/// An inbox that other users may write to, and the commands that run in it.
struct Inbox {
    dir: tempfile::TempDir,
}

impl Inbox {
    fn new(inbox_mode: u32) -> Inbox {
        let dir = tempfile::TempDir::with_prefix("qcbus-test-").unwrap();
        mode(dir.path(), 0o755);
        let inbox = Inbox { dir };
        std::fs::create_dir(inbox.path()).unwrap();
        mode(&inbox.path(), inbox_mode);
        std::fs::create_dir(inbox.run()).unwrap();
        inbox
    }

    fn path(&self) -> PathBuf {
        self.dir.path().join("inbox")
    }

    fn run(&self) -> PathBuf {
        self.dir.path().join("run")
    }

    fn trace(&self) -> PathBuf {
        self.dir.path().join("trace")
    }

    /// Writes a file that belongs to the hostile user.
    fn plant(&self, name: &str, content: &str) -> PathBuf {
        let path = self.path().join(name);
        for parent in Path::new(name)
            .ancestors()
            .skip(1)
            .collect::<Vec<_>>()
            .iter()
            .rev()
        {
            let parent = self.path().join(parent);
            if !parent.exists() {
                std::fs::create_dir(&parent).unwrap();
                give(&parent, NEIGHBOUR);
            }
        }
        std::fs::write(&path, content).unwrap();
        give(&path, NEIGHBOUR);
        path
    }

    /// Returns the command `cd inbox && qcbus serve .`.
    fn serve_command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command
            .args(["serve", ".", "--no-standard-bundles"])
            .args(more)
            .current_dir(self.path())
            .env("XDG_RUNTIME_DIR", self.run())
            .env("NO_COLOR", "1");
        command
    }

    fn is_refused(&self, more: &[&str], because: &[&str]) {
        let log = self.dir.path().join("log");
        let mut broker = Broker::start(&mut self.serve_command(more), &log);
        let said = || std::fs::read_to_string(&log).unwrap();
        // If the broker is not refused, it may run the hostile program, which leaves a trace.
        until_or(
            "the broker refuses to start",
            || {
                assert!(
                    !self.trace().exists(),
                    "the program of another user must not run"
                );
                (!broker.is_alive()).then_some(())
            },
            said,
        );
        assert_eq!(broker.wait().code(), Some(2), "{}", said());
        for part in because {
            assert!(said().contains(part), "expected `{part}` in: {}", said());
        }
    }
}

#[test]
fn manifest_planted_in_the_inbox_is_not_run() {
    if !is_root() {
        return;
    }
    for inbox_mode in [0o777, 0o1777] {
        let inbox = Inbox::new(inbox_mode);
        inbox.plant(
            "qcbus-out/.qcbus/bundles.d/evil.json",
            &evil(&inbox.trace()),
        );
        let because = match inbox_mode {
            0o777 => "everyone may write to",
            _ => "qcbus-out belongs to user 12345",
        };
        inbox.is_refused(&[], &[because, "qcbus-out/.qcbus/bundles.d", "--state"]);
    }
}

#[test]
fn state_directory_replaceable_by_others_is_refused() {
    if !is_root() {
        return;
    }
    let open = Inbox::new(0o777);
    open.is_refused(&[], &["inbox (mode 0777)", "chmod +t", "--state"]);
    assert!(
        !open.path().join("qcbus-out").exists(),
        "nothing may be created there"
    );
    let planted = Inbox::new(0o1777);
    planted.plant("qcbus-out/note", "");
    planted.is_refused(&[], &["qcbus-out belongs to user 12345", "--state"]);
    let team = Inbox::new(0o2775);
    chown(team.path(), None, Some(NEIGHBOUR)).unwrap();
    mode(&team.path(), 0o2775);
    team.is_refused(&[], &["group 12345 may write", "chmod g-w", "--state"]);
}

#[test]
fn shared_inbox_with_the_sticky_bit_is_served() {
    if !is_root() {
        return;
    }
    let inbox = Inbox::new(0o1777);
    let log = inbox.dir.path().join("log");
    let _broker = Broker::start(&mut inbox.serve_command(&[]), &log);
    until_or(
        "the broker answers",
        || {
            let asked = Command::new(env!("CARGO_BIN_EXE_qcbus"))
                .arg("status")
                .env("XDG_RUNTIME_DIR", inbox.run())
                .output();
            asked.unwrap().status.success().then_some(())
        },
        || std::fs::read_to_string(&log).unwrap(),
    );
}

#[test]
fn configuration_or_program_of_another_user_is_refused() {
    if !is_root() {
        return;
    }
    let inbox = Inbox::new(0o755);
    let own = inbox.dir.path().join("own.d");
    std::fs::create_dir(&own).unwrap();
    let config = inbox.plant("config.xml", "<Config/>");
    inbox.is_refused(
        &["-c", config.to_str().unwrap()],
        &["config.xml belongs to user 12345"],
    );
    let script = inbox.plant(
        "run.sh",
        &format!("#!/bin/sh\ntouch {}\n", inbox.trace().display()),
    );
    mode(&script, 0o755);
    let shown = script.display();
    for command in [
        format!("{shown} --x"),
        format!("sh -e {shown}"),
        "./run.sh".to_owned(),
    ] {
        std::fs::write(own.join("evil.json"), manifest(&command)).unwrap();
        inbox.is_refused(
            &["--bundles-d", own.to_str().unwrap()],
            &[
                "evil.json: `evil` is not started",
                "run.sh belongs to user 12345",
            ],
        );
    }
}

#[test]
fn manifest_planted_later_is_reported_and_not_run() {
    if !is_root() {
        return;
    }
    let farm = Farm::with(&["--no-standard-bundles"]);
    let _broker = farm.serve();
    until_so("the broker answers", || farm.status().is_some());
    let trace = farm.base().join("trace");
    let path = farm.bundles_d().join("evil.json");
    std::fs::write(farm.base().join("evil"), evil(&trace)).unwrap();
    give(&farm.base().join("evil"), NEIGHBOUR);
    std::fs::rename(farm.base().join("evil"), &path).unwrap();
    let is_said = |text: &str| {
        let said = |notices: &[qcbus_messages::control::NoticeStatus]| {
            let mut notices = notices.iter();
            notices.any(|it| it.kind == "loading" && it.text.contains(text))
        };
        until_or(
            "the neighbour's manifest is said",
            || {
                farm.status()
                    .filter(|status| said(&status.notices))
                    .map(drop)
            },
            || format!("no `{text}` in {}", farm.log()),
        );
    };
    is_said("evil.json belongs to user 12345");
    std::fs::remove_file(&path).unwrap();
    // From now on every user may write to this directory.
    mode(&farm.bundles_d(), 0o777);
    is_said("everyone may write to");
    let older = |it: &qcbus_messages::control::NoticeStatus| it.text.contains("user 12345");
    let notices = farm.status().unwrap().notices;
    assert!(
        !notices.iter().any(older),
        "the notice of the removed manifest must be gone: {notices:?}"
    );
    std::fs::write(&path, evil(&trace)).unwrap();
    let reload = farm.qcbus(&["reload"]);
    assert!(!reload.status.success(), "{reload:?}");
    assert!(!trace.exists(), "the program of another user must not run");
}

#[test]
fn program_writable_by_others_is_not_restarted() {
    let farm = Farm::with(&["--no-standard-bundles"]);
    let (program, trace) = (farm.base().join("program"), farm.base().join("trace"));
    std::fs::write(&program, "#!/bin/sh\nexit 1\n").unwrap();
    mode(&program, 0o755);
    std::fs::write(
        farm.bundles_d().join("evil.json"),
        manifest(program.to_str().unwrap()),
    )
    .unwrap();
    let _broker = farm.serve();
    let note = |text: &str| {
        let mut notices = farm.status()?.notices.into_iter();
        notices.any(|it| it.text.contains(text)).then_some(())
    };
    let explain = || format!("{:#?}\n{}", farm.status(), farm.log());
    until_or("it has failed", || note("exit code 1"), explain);
    mode(&program, 0o777);
    std::fs::write(&program, format!("#!/bin/sh\ntouch {}\n", trace.display())).unwrap();
    until_or(
        "it is not started",
        || note("everyone may write to"),
        explain,
    );
    assert!(!trace.exists(), "the program must not be started");
}

fn status_as(user: u32, runtime: &[(&str, &Path)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    // A broker of another test may run as `default`. It would be reported as another user's.
    command
        .args(["status", "--instance", "nobody-serves-this"])
        .env_remove("XDG_RUNTIME_DIR")
        .uid(user)
        .gid(user);
    command.envs(runtime.iter().copied()).output().unwrap()
}

fn mode_of(path: &Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o7777
}

#[test]
fn planted_runtime_directory_is_left_unchanged() {
    if !is_root() {
        return;
    }
    let dir = tempfile::TempDir::with_prefix("qcbus-test-").unwrap();
    mode(dir.path(), 0o1777);
    for user in [0, NOBODY] {
        let target = dir.path().join(format!("target-{user}"));
        std::fs::create_dir(&target).unwrap();
        give(&target, user);
        mode(&target, 0o755);
        let link = dir.path().join(format!("qcbus-{user}"));
        symlink(&target, &link).unwrap();
        lchown(&link, Some(NEIGHBOUR), Some(NEIGHBOUR)).unwrap();
        let said = status_as(user, &[("TMPDIR", dir.path())]);
        let text = String::from_utf8_lossy(&said.stderr).into_owned();
        assert_eq!(said.status.code(), Some(2), "{text}");
        assert!(text.contains("belongs to user 12345"), "{text}");
        assert!(text.contains("set XDG_RUNTIME_DIR"), "{text}");
        assert_eq!(
            mode_of(&target),
            0o755,
            "the target of the link must be unchanged"
        );
        assert_eq!(std::fs::read_dir(&target).unwrap().count(), 0);
        // After `su`, XDG_RUNTIME_DIR may still be the directory of the previous user.
        let theirs = dir.path().join(format!("theirs-{user}"));
        std::fs::create_dir(&theirs).unwrap();
        give(&theirs, NEIGHBOUR);
        mode(&theirs, 0o777);
        let said = status_as(user, &[("XDG_RUNTIME_DIR", &theirs)]);
        assert_eq!(said.status.code(), Some(2), "{said:?}");
        assert_eq!(mode_of(&theirs), 0o777);
        assert_eq!(std::fs::read_dir(&theirs).unwrap().count(), 0);
    }
}

#[test]
fn user_without_privileges_has_a_runtime_directory() {
    if !is_root() {
        return;
    }
    let dir = tempfile::TempDir::with_prefix("qcbus-test-").unwrap();
    mode(dir.path(), 0o1777);
    let said = status_as(NOBODY, &[("TMPDIR", dir.path())]);
    let text = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(text.contains("no broker serves"), "{text}");
    assert_eq!(mode_of(&dir.path().join("qcbus-65534")), 0o700);
}

/// Many sites share a results directory in a group. The broker must report the consequences.
#[test]
fn results_writable_by_others_are_reported() {
    let farm = Farm::new();
    std::fs::create_dir(farm.gate()).unwrap();
    mode(&farm.gate(), 0o777);
    let mut serve = farm.serve_command();
    serve.arg("--gate").arg(farm.gate());
    let _broker = Broker::start(&mut serve, &farm.log_path());
    until_so("the broker answers", || farm.status().is_some());
    let notices = farm.status().unwrap().notices;
    let said = notices.iter().find(|it| it.kind == "storing").unwrap();
    let gate = farm.gate();
    assert!(said.text.contains(gate.to_str().unwrap()), "{notices:?}");
    assert!(
        said.text.contains("is not under this user's sole control"),
        "{notices:?}"
    );
    assert!(!said.text.contains(farm.out().to_str().unwrap()));
}
