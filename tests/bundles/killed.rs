//! Bundles are killed in the middle of their work. No work is lost, and no unchecked file is
//! accepted.

use std::process::{Child, Command, Stdio};

use crate::support::content::Content;
use crate::support::farm::{Farm, shm_segments, tail, zoo};
use crate::support::processes::{parent_of, signal_pid};
use crate::support::watchdog::until_or;
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;
use qcbus_messages::control::PeerStatus;
use rustix::process::Signal;

/// Waits until `wanted` holds for a bundle in the status, and returns the bundle.
fn peer(farm: &Farm, name: &str, wanted: impl Fn(&PeerStatus) -> bool) -> PeerStatus {
    until_or(
        &format!("{name} gets there"),
        || {
            farm.status()?
                .peers
                .into_iter()
                .find(|it| it.name == name)
                .filter(&wanted)
        },
        || format!("{:#?}\n{}", farm.status(), tail(&farm.log())),
    )
}

fn kill(peer: &PeerStatus, signal: Signal) {
    signal_pid(i32::try_from(peer.pid).unwrap(), signal);
}

/// Returns the reasons why checkers of a bundle ended in error, from the result of a file.
fn errors(farm: &Farm, name: &str, bundle: &str) -> Vec<String> {
    let results = farm.result(name);
    let bundles = results.bundles.iter().filter(|it| it.name == bundle);
    let failed = bundles
        .flat_map(|it| &it.checkers)
        .filter(|it| it.status == Some(Status::Error));
    failed.map(|it| it.summary.to_string()).collect()
}

fn is_complete(farm: &Farm, name: &str, bundle: &str) -> bool {
    farm.verdict(name);
    let results = farm.result(name);
    let there = results
        .bundles
        .iter()
        .any(|it| it.name == bundle && !it.checkers.is_empty());
    there && errors(farm, name, bundle).is_empty()
}

#[test]
fn killed_standard_bundle_repeats_its_job() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let first = peer(&farm, "xodrBundle", |it| it.state == "ready");
    // The bundle is stopped before the file arrives, so it cannot finish before the kill.
    kill(&first, Signal::STOP);
    for number in 0..3 {
        farm.write(&format!("{number}.xodr"), &Content::Good(number).bytes());
    }
    farm.write("bad.xodr", &Content::NoHeader(9).bytes());
    peer(&farm, "xodrBundle", |it| it.active > 0);
    kill(&first, Signal::KILL);
    farm.settle(4);
    for number in 0..3 {
        let name = format!("{number}.xodr");
        assert_eq!(farm.verdict(&name).verdict, Verdict::Accepted);
        assert!(is_complete(&farm, &name, "xodrBundle"), "{name}");
    }
    assert_eq!(farm.verdict("bad.xodr").verdict, Verdict::Rejected);
    let second = peer(&farm, "xodrBundle", |it| it.state == "ready");
    assert_ne!(second.pid, first.pid);
    assert!(second.restarts >= 1);
}

#[test]
fn repeatedly_killed_bundle_completes_every_job() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    farm.let_in("slow", "--millis 300");
    let mut last = 0;
    for round in 0..3 {
        let name = format!("{round}.xodr");
        peer(&farm, "slow", |it| it.state == "ready" && it.pid != last);
        farm.write(&name, &Content::Good(round).bytes());
        let busy = peer(&farm, "slow", |it| it.active > 0);
        last = busy.pid;
        kill(&busy, Signal::KILL);
        assert_eq!(farm.verdict(&name).verdict, Verdict::Accepted, "{name}");
        assert!(is_complete(&farm, &name, "slow"), "{name}");
    }
    assert!(peer(&farm, "slow", |_| true).restarts >= 3);
}

/// A bundle that is not supervised. It is killed at the end of the test.
struct StartedManually(Child);

impl StartedManually {
    fn start(farm: &Farm, millis: &str) -> StartedManually {
        let mut command = Command::new(zoo());
        command
            .args(["slow", "--millis", millis, "--instance-dir"])
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

#[test]
fn bundle_not_restarted_leaves_errors_until_it_is_back() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    // The bundle never finishes a job, so it is killed in the middle of one.
    let bundle = StartedManually::start(&farm, "600000");
    peer(&farm, "slow", |it| it.state == "ready");
    farm.write("a.xodr", &Content::Good(1).bytes());
    farm.write("bad.xodr", &Content::NoHeader(2).bytes());
    peer(&farm, "slow", |it| it.active > 0);
    drop(bundle);
    // The job ends by itself. The missing checkers are listed, and the file is not accepted.
    let verdict = farm.verdict("a.xodr");
    assert_eq!(verdict.verdict, Verdict::Undetermined);
    assert!(
        verdict.why.iter().any(|it| it.contains("check_zoo_0")),
        "{:?}",
        verdict.why
    );
    assert_eq!(
        errors(&farm, "a.xodr", "slow").len(),
        2,
        "{:#?}",
        farm.result("a.xodr")
    );
    assert!(
        is_complete(&farm, "a.xodr", "xodrBundle"),
        "the work of the other bundles counts"
    );
    assert_eq!(
        farm.verdict("bad.xodr").verdict,
        Verdict::Rejected,
        "an error rejects the file"
    );
    let said = farm.qcbus(&["wait", &farm.root().join("a.xodr").to_string_lossy()]);
    assert_eq!(said.status.code(), Some(3));
    // The next jobs go on without acceptance, because the bundle has not left properly.
    farm.write("next.xodr", &Content::Good(3).bytes());
    assert_eq!(farm.verdict("next.xodr").verdict, Verdict::Undetermined);
    // The bundle is back: all results become complete, including those that were made without it.
    let _bundle = StartedManually::start(&farm, "1");
    farm.write("after.xodr", &Content::Good(4).bytes());
    for name in ["after.xodr", "next.xodr", "a.xodr", "bad.xodr"] {
        until_or(
            &format!("{name} is complete"),
            || is_complete(&farm, name, "slow").then_some(()),
            || format!("{:#?}\n{}", farm.verdict(name), tail(&farm.log())),
        );
    }
    for name in ["after.xodr", "next.xodr", "a.xodr"] {
        assert_eq!(farm.verdict(name).verdict, Verdict::Accepted, "{name}");
    }
}

/// Creates a bundle that hangs when its broker is killed, so that the next one does not know it.
/// (The system would send SIGHUP to a bundle that is only stopped, because its process group has
/// lost its parent.)
///
/// Returns it with its launcher, which is the process that the broker has started.
fn frozen(farm: &Farm) -> (PeerStatus, u32) {
    let mut broker = farm.serve_ready();
    farm.let_in("hangs_after_hello", "");
    let frozen = peer(farm, "hangs_after_hello", |it| it.pid != 0);
    until_or(
        "it hangs",
        || farm.log().contains("does nothing any more").then_some(()),
        || farm.log(),
    );
    let launcher = parent_of(frozen.pid);
    broker.kill();
    (frozen, launcher)
}

fn has_gone(farm: &Farm, frozen: &PeerStatus) {
    let pid = i32::try_from(frozen.pid).unwrap();
    until_or(
        "what hangs is killed",
        || {
            farm.processes()
                .iter()
                .all(|it| it.pid != pid)
                .then_some(())
        },
        || format!("{:#?}\n{}", farm.processes(), tail(&farm.log())),
    );
}

#[test]
fn hanging_stale_child_is_killed_by_the_next_broker() {
    let farm = Farm::new();
    let (frozen, launcher) = frozen(&farm);
    farm.send_away("hangs_after_hello");
    let _broker = farm.serve_ready();
    has_gone(&farm, &frozen);
    // The first of the two that is killed ends the other one, too.
    let words =
        [frozen.pid, launcher].map(|pid| format!("process {pid}, which an earlier broker started"));
    let is_said = || words.iter().any(|it| farm.log().contains(it));
    until_or("it is said", || is_said().then_some(()), || farm.log());
}

#[test]
fn hanging_stale_child_does_not_outlive_the_next_broker() {
    let farm = Farm::new();
    let (frozen, _) = frozen(&farm);
    let _broker = farm.serve_ready();
    assert!(farm.qcbus(&["down"]).status.success());
    has_gone(&farm, &frozen);
}

/// A cleanup after a crash removes the only directory that knew of the shared memory.
#[test]
fn forgotten_shared_memory_is_released() {
    let (farm, other) = (Farm::new(), Farm::new());
    let mut broker = farm.serve_ready();
    let _alive = other.serve_ready();
    let prefixes = [&farm, &other].map(Farm::shm_prefix);
    assert!(!shm_segments(&prefixes[0]).is_empty());
    broker.kill();
    std::fs::remove_dir_all(farm.instance()).unwrap();
    // The next process of any instance releases it. This may be a broker of another test.
    farm.write("good.xodr", &Content::Good(1).bytes());
    let file = farm.root().join("good.xodr");
    let mut check = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    let check = check.arg("check").arg(file).arg("--out");
    let checked = check.arg(farm.base().join("checked")).output().unwrap();
    assert_eq!(checked.status.code(), Some(0), "{checked:?}");
    assert_eq!(shm_segments(&prefixes[0]), [""; 0]);
    assert!(
        !shm_segments(&prefixes[1]).is_empty(),
        "the shared memory of the living broker is kept"
    );
    other.write("good.xodr", &Content::Good(1).bytes());
    assert_eq!(other.verdict("good.xodr").verdict, Verdict::Accepted);
}
