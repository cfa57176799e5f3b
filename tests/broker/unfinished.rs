//! Tests that a slowly written file is judged once, when it is finished. The writers here pause as
//! long as the test wants: they keep the file open until something has been seen.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use crate::support::cli::Cli;
use crate::support::content::{CATALOG, Content, Mark};
use crate::support::farm::{Farm, tail};
use crate::support::watchdog::{until, until_or, until_so};
use qcbus_messages::Verdict;

/// Creates a farm with a gate.
fn farm(arguments: &[&str]) -> Farm {
    let mut farm = Farm::with(arguments);
    let gate = farm.gate().to_string_lossy().into_owned();
    farm.arguments.extend(["--gate".to_owned(), gate]);
    farm
}

/// Opens a file as an upload server does, and writes the first part of a good map.
fn begin(farm: &Farm, name: &str) -> (File, Vec<u8>) {
    let bytes = Content::Good(1).bytes();
    let (first, rest) = bytes.split_at(bytes.len() / 2);
    let mut file = File::create(farm.root().join(name)).unwrap();
    file.write_all(first).unwrap();
    (file, rest.to_vec())
}

/// Returns the reason in the status why a file is not judged yet.
fn unfinished(farm: &Farm, name: &str) -> String {
    let path = farm.root().join(name);
    let look = || {
        let all = farm.status()?.unfinished;
        Some(all.into_iter().find(|it| it.path == path)?.why)
    };
    let explain = || tail(&farm.log());
    until_or("the status says why a file is not judged", look, explain)
}

/// Returns how often a verdict on a file was logged.
fn verdicts(farm: &Farm, name: &str) -> usize {
    let log = farm.log();
    log.matches(&format!("{name} verdict=")).count()
}

fn is_published(farm: &Farm, names: &[&str]) -> bool {
    names.iter().all(|name| farm.gate().join(name).exists())
}

/// Checks that a client with a short timeout learns why there is no verdict.
fn is_not_told(farm: &Farm, name: &str, why: &str) {
    farm.wait_in_vain(&farm.root().join(name), &[], why);
}

/// Starts a client that waits for a verdict.
fn client(farm: &Farm, name: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    let command = command.arg("wait").arg(farm.root().join(name));
    let command = command.arg("--instance-dir").arg(farm.instance());
    command.stdout(Stdio::null()).spawn().unwrap()
}

#[test]
fn paused_upload_is_judged_once_when_closed() {
    let farm = farm(&[]);
    let _broker = farm.serve_ready();
    let (mut file, rest) = begin(&farm, "slow.xodr");
    let mut client = client(&farm, "slow.xodr");
    let why = unfinished(&farm, "slow.xodr");
    assert!(why.starts_with("it is open for writing"), "{why}");
    let (first, last) = rest.split_at(rest.len() / 2);
    file.write_all(first).unwrap();
    is_not_told(&farm, "slow.xodr", "open for writing");
    file.write_all(last).unwrap();
    is_not_told(&farm, "slow.xodr", "open for writing");
    assert_eq!(client.try_wait().unwrap(), None);
    assert_eq!(verdicts(&farm, "slow.xodr"), 0);
    drop(file);
    let code = until("the client is answered", || client.try_wait().unwrap());
    assert_eq!(code.code(), Some(0));
    assert_eq!(farm.verdict("slow.xodr").verdict, Verdict::Accepted);
    let status = farm.settle(1);
    assert_eq!(
        (status.unfinished, verdicts(&farm, "slow.xodr")),
        (vec![], 1)
    );
}

#[test]
fn empty_upload_in_progress_is_not_judged() {
    let farm = farm(&[]);
    let _broker = farm.serve_ready();
    let file = File::create(farm.root().join("slow.xodr")).unwrap();
    unfinished(&farm, "slow.xodr");
    // Another name for a finished file is judged although the file is not closed again.
    let (aside, place) = (farm.base().join("aside"), farm.root().join("linked.xodr"));
    std::fs::write(&aside, Content::Good(2).bytes()).unwrap();
    std::fs::hard_link(&aside, place).unwrap();
    let linked = || verdicts(&farm, "linked.xodr") == 1;
    until_so("the other file is judged", linked);
    assert_eq!(verdicts(&farm, "slow.xodr"), 0);
    // The file is removed before it is finished.
    std::fs::remove_file(farm.root().join("slow.xodr")).unwrap();
    until_so("nothing is unfinished", || {
        farm.status().is_some_and(|it| it.unfinished.is_empty())
    });
    drop(file);
}

#[test]
fn upload_of_a_killed_writer_is_judged_unchanged() {
    let farm = farm(&[]);
    let _broker = farm.serve_ready();
    let path = farm.root().join("slow.xodr");
    let mut writer = Command::new("sh")
        .args(["-c", "exec 3>\"$0\"; echo '<OpenDRIVE>' >&3; read -r line"])
        .arg(&path)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    unfinished(&farm, "slow.xodr");
    writer.kill().unwrap();
    writer.wait().unwrap();
    assert_eq!(farm.verdict("slow.xodr").verdict, Verdict::Rejected);
    assert_eq!(verdicts(&farm, "slow.xodr"), 1);
}

#[test]
fn file_open_at_the_start_is_judged_when_closed() {
    let farm = farm(&[]);
    let (mut file, rest) = begin(&farm, "slow.xodr");
    let _broker = farm.serve_ready();
    unfinished(&farm, "slow.xodr");
    is_not_told(&farm, "slow.xodr", "open for writing");
    file.write_all(&rest).unwrap();
    drop(file);
    assert_eq!(farm.verdict("slow.xodr").verdict, Verdict::Accepted);
    farm.settle(1);
    assert_eq!(verdicts(&farm, "slow.xodr"), 1);
}

#[test]
fn accepted_file_is_withdrawn_while_it_is_written_to() {
    let farm = farm(&[]);
    std::fs::create_dir(farm.root().join("catalogs")).unwrap();
    farm.write(CATALOG, &Content::Catalog(1, Mark::Clean).bytes());
    farm.write("map.xodr", &Content::Good(2).bytes());
    let scenario = Content::Scenario(3, "map.xodr".to_owned());
    farm.write("s.xosc", &scenario.bytes());
    let _broker = farm.serve_ready();
    let all = [CATALOG, "map.xodr", "s.xosc"];
    until_so("all is published", || is_published(&farm, &all));
    farm.settle(3);
    let map = farm.root().join("map.xodr");
    let mut writer = OpenOptions::new().append(true).open(map).unwrap();
    writer.write_all(b"<!-- more").unwrap();
    until_so("the map and its scenario are not published", || {
        !farm.gate().join("map.xodr").exists() && !farm.gate().join("s.xosc").exists()
    });
    assert!(is_published(&farm, &all[..1]));
    is_not_told(&farm, "map.xodr", "open for writing");
    is_not_told(&farm, "s.xosc", "");
    writer.write_all(b" -->\n").unwrap();
    drop(writer);
    assert_eq!(farm.verdict("s.xosc").verdict, Verdict::Accepted);
    until_so("all is published", || is_published(&farm, &all));
    assert_eq!(verdicts(&farm, "map.xodr"), 2);
}

#[test]
fn settle_time_counts_after_close_but_not_rename() {
    let farm = farm(&["--settle", "1h"]);
    let _broker = farm.serve_ready();
    farm.write("closed.xodr", &Content::Good(1).bytes());
    let why = unfinished(&farm, "closed.xodr");
    assert!(why.contains("has not changed for 3600 s"), "{why}");
    let aside = farm.root().join("renamed.xodr.part");
    std::fs::write(&aside, Content::Good(2).bytes()).unwrap();
    std::fs::rename(aside, farm.root().join("renamed.xodr")).unwrap();
    let renamed = || verdicts(&farm, "renamed.xodr") == 1;
    until_so("the renamed file is judged", renamed);
    is_not_told(&farm, "closed.xodr", "has not changed for 3600 s");
    let said = farm.qcbus(&["status"]);
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("not judged yet: "), "{said}");
    assert_eq!(verdicts(&farm, "closed.xodr"), 0);
}

#[test]
fn closed_file_is_judged_after_its_settle_time() {
    let farm = farm(&["--settle", "10ms"]);
    let _broker = farm.serve_ready();
    farm.write("closed.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("closed.xodr").verdict, Verdict::Accepted);
}

#[test]
fn check_accepts_a_file_open_for_writing() {
    let cli = Cli::new();
    let path = cli.write("a.xodr", Content::Good(1).bytes());
    let _writer = OpenOptions::new().append(true).open(&path).unwrap();
    let said = cli.qcbus(&["check", "a.xodr", "--out", "out"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(Path::new(&cli.path().join("out/a.xodr.xqar")).exists());
}
