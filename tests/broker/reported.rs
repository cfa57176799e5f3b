//! Tests waiting for reports, and reports that cannot be written for a while.

use std::path::PathBuf;
use std::process::Output;

use crate::support::content::Content;
use crate::support::farm::{Farm, tail};
use crate::support::watchdog::until_or;

/// Returns the path of the text report on a file.
fn report(farm: &Farm, name: &str) -> PathBuf {
    farm.out().join(format!("{name}.txt"))
}

/// Blocks the path of a report by a directory, so that no user can write it.
fn obstruct(farm: &Farm, name: &str) -> PathBuf {
    let obstacle = report(farm, name).join("obstacle");
    std::fs::create_dir_all(&obstacle).unwrap();
    obstacle
}

fn clear(farm: &Farm, name: &str) {
    std::fs::remove_dir_all(report(farm, name)).unwrap();
}

fn wait(farm: &Farm, name: &str, further: &[&str]) -> Output {
    let file = farm.root().join(name);
    let wait = ["wait", file.to_str().unwrap(), "--reports"];
    farm.qcbus(&[&wait, further].concat())
}

fn remark(farm: &Farm) -> String {
    let peers = farm.status().map(|it| it.peers).unwrap_or_default();
    let mut reporters = peers.into_iter().filter(|it| it.role == "reporter");
    reporters.next().map(|it| it.note).unwrap_or_default()
}

#[test]
fn wait_returns_when_reports_are_written() {
    let farm = Farm::with(&["--report", "text", "--report", "json"]);
    let _broker = farm.serve_ready();
    for number in 0..20 {
        let name = format!("{number}.xodr");
        farm.write(&name, &Content::Good(number).bytes());
        let said = wait(&farm, &name, &[]);
        assert_eq!(said.status.code(), Some(0), "{said:?}");
        assert!(report(&farm, &name).is_file(), "{name}");
        let json = farm.out().join(format!("{name}.json"));
        assert!(json.is_file(), "{name}");
    }
}

#[test]
fn wait_names_the_reporter_whose_report_is_missing() {
    let farm = Farm::with(&["--report", "text"]);
    let _broker = farm.serve_ready();
    obstruct(&farm, "a.xodr");
    farm.write("a.xodr", &Content::Good(1).bytes());
    farm.verdict("a.xodr");
    let failed = || remark(&farm).contains("1 not reported").then_some(());
    until_or("it fails", failed, || tail(&farm.log()));
    let file = farm.root().join("a.xodr");
    let said = farm.wait_in_vain(&file, &["--reports"], "not all reports on ");
    let why = String::from_utf8(said.stderr).unwrap();
    assert!(why.contains("1 not reported: failed to"), "{why}");
    let verdict = String::from_utf8(said.stdout).unwrap();
    assert!(verdict.contains("a.xodr: accepted"), "{verdict}");
}

#[test]
fn failed_report_is_written_as_soon_as_possible() {
    let farm = Farm::with(&["--report", "text"]);
    let _broker = farm.serve_ready();
    obstruct(&farm, "a.xodr");
    farm.write("a.xodr", &Content::Good(1).bytes());
    farm.verdict("a.xodr");
    let failed = || remark(&farm).contains("1 not reported").then_some(());
    until_or("it fails", failed, || tail(&farm.log()));
    clear(&farm, "a.xodr");
    let said = wait(&farm, "a.xodr", &[]);
    assert_eq!(said.status.code(), Some(0), "{said:?}");
    assert!(report(&farm, "a.xodr").is_file());
    assert_eq!(remark(&farm), "");
    let status = farm.status().unwrap();
    let missing = status.notices.iter().find(|it| it.kind == "not-reported");
    assert_eq!(missing, None);
}
