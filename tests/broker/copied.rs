//! Removal by a broker: it removes no file from a foreign directory, for example after a state is
//! copied, moved or pointed elsewhere. In its own directory it removes empty directories.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::farm::Farm;
use crate::support::watchdog::until_or;

/// Creates a farm with a gate, and with reports beside its results.
fn farm_with_everything() -> Farm {
    let mut farm = Farm::new();
    let gate = farm.base().join("gate").to_string_lossy().into_owned();
    let arguments = ["--gate", &gate, "--report", "text"];
    farm.arguments.extend(arguments.map(str::to_owned));
    farm
}

/// Serves a good and a bad file until their reports exist.
fn serve_both(farm: &Farm) -> Broker {
    farm.write("good.xodr", &Content::Good(1).bytes());
    farm.write("bad.xodr", &Content::NoHeader(1).bytes());
    let broker = farm.serve_ready();
    farm.verdict("good.xodr");
    farm.verdict("bad.xodr");
    let reports = ["good.xodr.txt", "bad.xodr.txt"].map(|name| farm.out().join(name));
    let written = || reports.iter().all(|it| it.exists()).then_some(());
    until_or("the reports are there", written, || farm.log());
    broker
}

/// Returns every file that a farm has written for others.
fn written(farm: &Farm) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut open = vec![farm.out(), farm.base().join("gate")];
    while let Some(directory) = open.pop() {
        for entry in std::fs::read_dir(directory).unwrap() {
            let entry = entry.unwrap();
            if entry.file_name() == ".qcbus" {
                continue;
            }
            match entry.file_type().unwrap().is_dir() {
                true => open.push(entry.path()),
                false => files.push(entry.path()),
            }
        }
    }
    files.sort();
    files
}

fn copy_tree(from: &Path, to: &Path) {
    let copied = Command::new("cp").arg("-a").arg(from).arg(to).status();
    assert!(copied.unwrap().success());
}

#[test]
fn copied_farm_changes_nothing_in_the_original() {
    let live = farm_with_everything();
    let mut broker = serve_both(&live);
    let before = written(&live);
    assert_eq!(
        before.len(),
        8,
        "results, verdicts, reports, a published file: {before:?}"
    );

    let copy = farm_with_everything();
    for name in ["farm", "out"] {
        let place = copy.base().join(name);
        if place.exists() {
            std::fs::remove_dir_all(&place).unwrap();
        }
    }
    copy_tree(&live.root(), &copy.root());
    copy_tree(&live.out(), &copy.out());
    let mut second = copy.serve_ready();
    copy.verdict("good.xodr");
    copy.verdict("bad.xodr");
    copy.settle(2);
    let said = format!("is a copy of {}", live.out().join(".qcbus").display());
    until_or(
        "the copy says what it is",
        || copy.log().contains(&said).then_some(()),
        || copy.log(),
    );
    assert_eq!(copy.qcbus(&["down"]).status.code(), Some(0));
    assert!(second.wait().success());
    assert_eq!(written(&live), before, "{}", copy.log());
    assert_eq!(live.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

#[test]
fn results_of_a_removed_directory_are_removed() {
    let farm = farm_with_everything();
    let mut broker = farm.serve_ready();
    for day in ["2026-11-20/a", "2026-11-21", "kept"] {
        std::fs::create_dir_all(farm.root().join(day)).unwrap();
    }
    for day in ["2026-11-20/a", "2026-11-21"] {
        farm.write(&format!("{day}/good.xodr"), &Content::Good(1).bytes());
        farm.verdict(&format!("{day}/good.xodr"));
    }
    farm.write("kept/good.xodr", &Content::Good(2).bytes());
    farm.verdict("kept/good.xodr");
    let below = |day: &str| [farm.out().join(day), farm.base().join("gate").join(day)];
    let report = farm.out().join("kept/good.xodr.txt");
    let published = farm.base().join("gate/kept/good.xodr");
    let there = || (report.exists() && published.exists()).then_some(());
    until_or("everything is written", there, || farm.log());
    for day in ["2026-11-20", "2026-11-21"] {
        std::fs::remove_dir_all(farm.root().join(day)).unwrap();
    }
    let gone = || {
        let mut left = ["2026-11-20", "2026-11-21"].into_iter().flat_map(below);
        (!left.any(|it| it.exists())).then_some(())
    };
    until_or("their directories go", gone, || farm.log());
    assert!(below("kept").iter().all(|it| it.exists()));
    assert_eq!(farm.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
}

#[test]
fn results_of_another_broker_are_left_alone() {
    let first = farm_with_everything();
    let mut broker = serve_both(&first);
    assert_eq!(first.qcbus(&["down"]).status.code(), Some(0));
    assert!(broker.wait().success());
    let state = first.base().join("state");
    copy_tree(&first.out().join(".qcbus"), &state);

    // Another broker writes results of files with the same names there.
    std::fs::remove_dir_all(first.out()).unwrap();
    let inbox = first.base().join("other");
    std::fs::create_dir(&inbox).unwrap();
    std::fs::write(inbox.join("good.xodr"), Content::Good(2).bytes()).unwrap();
    let serve = |directory: &Path, instance: &str, more: &[(&str, &Path)]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.arg("serve").arg(directory).env("NO_COLOR", "1");
        command
            .arg("--instance-dir")
            .arg(first.base().join(instance));
        for (option, place) in more {
            command.arg(option).arg(place);
        }
        command
    };
    let out = first.out();
    let mut other = Broker::start(
        &mut serve(&inbox, "other-instance", &[("--out", &out)]),
        &first.log_path(),
    );
    let theirs = out.join("good.xodr.xqar");
    until_or(
        "the other has a result",
        || theirs.exists().then_some(()),
        || first.log(),
    );

    let elsewhere = first.base().join("elsewhere");
    let moved = [("--out", &*elsewhere), ("--state", &*state)];
    let mut broker = Broker::start(
        &mut serve(&first.root(), "instance", &moved),
        &first.log_path(),
    );
    let ours = elsewhere.join("good.xodr.xqar");
    until_or(
        "the first has a result",
        || ours.exists().then_some(()),
        || first.log(),
    );
    let said = format!("results in {} are left alone", out.display());
    until_or(
        "it says so",
        || first.log().contains(&said).then_some(()),
        || first.log(),
    );
    assert!(theirs.exists(), "{}", first.log());
    broker.kill();
    other.kill();
}
