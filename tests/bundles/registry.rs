//! Tests that required bundles stay required: a file is not accepted because a bundle is missing.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::support::cli::Cli;
use crate::support::content::Content;
use crate::support::farm::{Farm, zoo};
use crate::support::processes::signal_pid;
use crate::support::programs::copy_program;
use crate::support::watchdog::until_or;
use qcbus_messages::Verdict;
use qcbus_messages::control::{Request, Response};
use rustix::process::Signal;

/// Returns a road network that only the custom bundle rejects.
fn forbidden() -> Vec<u8> {
    let text = String::from_utf8(Content::Good(7).bytes()).unwrap();
    text.replace("name=\"n7\"", "name=\"forbidden\"")
        .into_bytes()
}

/// Returns a farm with a short time limit for missing bundles.
fn farm() -> Farm {
    let mut farm = Farm::with(&["--absence-limit", "1s"]);
    let gate = farm.base().join("gate");
    farm.arguments
        .extend(["--gate".to_owned(), gate.display().to_string()]);
    farm
}

fn is_published(farm: &Farm, name: &str) -> bool {
    farm.base().join("gate").join(name).exists()
}

fn manifest(directory: &Path, command: &str) {
    let manifest = serde_json::json!({ "module": [{
        "name": "mine",
        "exec_type": "executable",
        "module_type": "checker_bundle",
        "exec_command": command,
        "mode": "bus",
    }]});
    let unfinished = directory.join(".mine");
    std::fs::write(&unfinished, manifest.to_string()).unwrap();
    std::fs::rename(unfinished, directory.join("mine.json")).unwrap();
}

/// Copies the zoo program, so that it can be deleted.
fn own_program(directory: &Path) -> PathBuf {
    let own = directory.join("mine");
    copy_program(&zoo(), &own);
    own
}

fn is_ready(farm: &Farm, name: &str) {
    let ready = || {
        let peers = farm.status()?.peers;
        let ready = |state: &str| state == "ready" || state == "busy";
        let mut found = peers.iter().filter(|it| it.name == name);
        found.any(|it| ready(&it.state)).then_some(())
    };
    until_or("the bundle is ready", ready, || farm.log());
}

/// A bundle that a user starts manually. It is killed on drop.
struct StartedManually(Child);

impl StartedManually {
    fn start(farm: &Farm, animal: &str) -> StartedManually {
        let child = Command::new(zoo())
            .args([animal, "--name", "mine", "--instance-dir"])
            .arg(farm.instance())
            .stdin(Stdio::null())
            .spawn();
        is_ready(farm, "mine");
        StartedManually(child.unwrap())
    }

    fn signal(&self, signal: Signal) {
        signal_pid(i32::try_from(self.0.id()).unwrap(), signal);
    }
}

impl Drop for StartedManually {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Checks that neither the rejected file nor a new one is accepted while `mine` is missing.
fn nothing_is_accepted_without_mine(farm: &Farm) {
    let before = farm.verdict("forbidden.xodr");
    assert_ne!(before.verdict, Verdict::Accepted, "{before:?}");
    farm.write("new.xodr", &Content::Good(8).bytes());
    let told = farm.verdict("new.xodr");
    assert_eq!(told.verdict, Verdict::Undetermined, "{told:?}");
    assert!(told.why.iter().any(|it| it.contains("mine")), "{told:?}");
    assert!(!is_published(farm, "new.xodr") && !is_published(farm, "forbidden.xodr"));
}

#[test]
fn missing_manifest_directory_prevents_acceptance() {
    let farm = farm();
    let program = zoo();
    let command = format!("{} judges_strictly --name mine", program.display());
    manifest(&farm.bundles_d(), &command);
    let _broker = farm.serve_ready();
    is_ready(&farm, "mine");
    farm.write("forbidden.xodr", &forbidden());
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Rejected);
    let aside = farm.base().join("aside");
    std::fs::rename(farm.bundles_d(), &aside).unwrap();
    let answer = farm.ask(&Request::Reload);
    assert!(
        matches!(answer, Some(Response::Failed { .. })),
        "{answer:?}"
    );
    std::fs::create_dir(farm.bundles_d()).unwrap();
    let answer = farm.ask(&Request::Reload);
    assert!(
        matches!(answer, Some(Response::Failed { .. })),
        "{answer:?}"
    );
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Rejected);
    farm.write("new.xodr", &forbidden());
    assert_eq!(farm.verdict("new.xodr").verdict, Verdict::Rejected);
    std::fs::remove_dir(farm.bundles_d()).unwrap();
    std::fs::rename(&aside, farm.bundles_d()).unwrap();
    let answer = farm.ask(&Request::Reload);
    assert!(
        matches!(answer, Some(Response::Reloaded { .. })),
        "{answer:?}"
    );
}

#[test]
fn missing_bundle_program_prevents_acceptance() {
    let farm = farm();
    let program = own_program(farm.base());
    manifest(
        &farm.bundles_d(),
        &format!("{} judges_strictly --name mine", program.display()),
    );
    let mut broker = farm.serve_ready();
    is_ready(&farm, "mine");
    farm.write("forbidden.xodr", &forbidden());
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Rejected);
    broker.kill();
    std::fs::remove_file(&program).unwrap();
    for process in farm.processes() {
        process.signal(Signal::KILL);
    }
    let _broker = farm.serve_ready();
    nothing_is_accepted_without_mine(&farm);
    // The bundle is no longer required only after its manifest is removed, too.
    std::fs::remove_file(farm.bundles_d().join("mine.json")).unwrap();
    let accepted = || (farm.verdict("new.xodr").verdict == Verdict::Accepted).then_some(());
    until_or("it is accepted without", accepted, || farm.log());
}

#[test]
fn stopped_bundle_prevents_acceptance_after_a_restart() {
    let farm = farm();
    let mut broker = farm.serve_ready();
    let mine = StartedManually::start(&farm, "judges_strictly");
    farm.write("forbidden.xodr", &forbidden());
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Rejected);
    mine.signal(Signal::STOP);
    broker.kill();
    let _broker = farm.serve_ready();
    nothing_is_accepted_without_mine(&farm);
    mine.signal(Signal::CONT);
    is_ready(&farm, "mine");
    let accepted = || (farm.verdict("new.xodr").verdict == Verdict::Accepted).then_some(());
    until_or("it judges again", accepted, || farm.log());
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Rejected);
}

#[test]
fn manually_started_bundle_is_required_until_removed() {
    let farm = farm();
    let mut broker = farm.serve_ready();
    let mine = StartedManually::start(&farm, "judges_strictly");
    farm.write("forbidden.xodr", &forbidden());
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Rejected);
    drop(mine);
    broker.kill();
    let _broker = farm.serve_ready();
    nothing_is_accepted_without_mine(&farm);
    let name = "mine".to_owned();
    let answer = farm.ask(&Request::RemoveBundle { name }).unwrap();
    assert!(matches!(answer, Response::Removed { .. }), "{answer:?}");
    assert_eq!(farm.verdict("new.xodr").verdict, Verdict::Accepted);
    assert_eq!(farm.verdict("forbidden.xodr").verdict, Verdict::Accepted);
}

#[test]
fn bundle_that_left_voluntarily_is_no_longer_required() {
    let farm = farm();
    let _broker = farm.serve_ready();
    let mut mine = StartedManually::start(&farm, "polite");
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Accepted);
    assert!(
        farm.result("a.xodr")
            .bundles
            .iter()
            .any(|it| it.name == "mine")
    );
    // A bundle that is told to stop unregisters.
    mine.signal(Signal::TERM);
    assert!(mine.0.wait().unwrap().success());
    let without = || {
        let told = farm.verdict("a.xodr").verdict == Verdict::Accepted;
        let bundles = farm.result("a.xodr").bundles;
        (told && bundles.iter().all(|it| it.name != "mine")).then_some(())
    };
    until_or("it is judged without", without, || farm.log());
}

#[test]
fn check_accepts_nothing_when_an_own_bundle_fails() {
    let cli = Cli::new();
    cli.write("a.xodr", Content::Good(1).bytes());
    let manifests = cli.write("bundles.d/.keep", "");
    let manifests = manifests.parent().unwrap();
    let commands = [
        ("gone", "/nowhere/mine".to_owned()),
        ("exits", "true".to_owned()),
        ("fails", "false".to_owned()),
        ("never joins", "sh -c 'sleep 1000' sh".to_owned()),
        (
            "says nothing",
            format!("{} hangs_after_hello --name mine", zoo().display()),
        ),
    ];
    for (what, command) in commands {
        manifest(manifests, &command);
        let said = cli.qcbus(&[
            "check",
            "a.xodr",
            "--bundles-d",
            "bundles.d",
            "--absence-limit",
            "2s",
            "--silence-limit",
            "2s",
        ]);
        assert_eq!(said.code, Some(3), "{what}: {said:?}");
        assert!(said.stdout.contains("mine"), "{what}: {said:?}");
    }
}
