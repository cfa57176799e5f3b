//! Tests results and published files that are removed or changed while the broker runs.

use std::path::{Path, PathBuf};

use crate::support::broker::Broker;
use crate::support::content::Content;
use crate::support::farm::Farm;
use crate::support::watchdog::until_or;

/// Returns a farm with a gate, and with the state beside the results.
fn farm() -> Farm {
    let mut farm = Farm::new();
    let (gate, state) = (farm.gate(), farm.base().join("state"));
    for (option, path) in [("--gate", gate), ("--state", state)] {
        let path = path.to_string_lossy().into_owned();
        farm.arguments.extend([option.to_owned(), path]);
    }
    farm
}

fn serve(farm: &Farm) -> Broker {
    farm.write("good.xodr", &Content::Good(1).bytes());
    std::fs::create_dir(farm.root().join("sub")).unwrap();
    farm.write("sub/bad.xodr", &Content::NoHeader(1).bytes());
    let broker = farm.serve_ready();
    farm.verdict("good.xodr");
    farm.verdict("sub/bad.xodr");
    there(farm, &outputs(farm));
    broker
}

/// Returns all outputs of the broker for the two files.
fn outputs(farm: &Farm) -> Vec<PathBuf> {
    let results = ["good.xodr", "sub/bad.xodr"].into_iter().flat_map(|name| {
        [".xqar", ".verdict.json"].map(|suffix| farm.out().join(format!("{name}{suffix}")))
    });
    results.chain([farm.gate().join("good.xodr")]).collect()
}

fn there(farm: &Farm, outputs: &[PathBuf]) {
    let all = || outputs.iter().all(|it| it.exists()).then_some(());
    until_or("all outputs are there", all, || farm.log());
}

/// Removes a directory in one step, because the broker writes to it again immediately.
fn remove_whole(directory: &Path) {
    let aside = directory.with_extension("aside");
    std::fs::rename(directory, &aside).unwrap();
    std::fs::remove_dir_all(&aside).unwrap();
}

/// Waits until the status reports a failure with these words.
fn until_failing(farm: &Farm, words: &str) {
    let told = || {
        let troubles = farm.status()?.troubles;
        troubles.iter().any(|it| it.contains(words)).then_some(())
    };
    until_or("the status tells it", told, || farm.log());
}

fn wait(farm: &Farm, name: &str) -> Option<i32> {
    let file = farm.root().join(name).to_string_lossy().into_owned();
    farm.qcbus(&["wait", &file]).status.code()
}

#[test]
fn removed_outputs_are_written_again() {
    let farm = farm();
    let _broker = serve(&farm);
    for output in outputs(&farm) {
        std::fs::remove_file(&output).unwrap();
        there(&farm, &outputs(&farm));
    }
    assert!(
        farm.log().contains("removed or changed by another process"),
        "{}",
        farm.log()
    );
}

#[test]
fn wait_answers_with_an_existing_result() {
    let farm = farm();
    let _broker = serve(&farm);
    for output in outputs(&farm) {
        let (name, code) = match output.ends_with("good.xodr") || is_of_good(&output) {
            true => ("good.xodr", 0),
            false => ("sub/bad.xodr", 1),
        };
        std::fs::remove_file(&output).unwrap();
        assert_eq!(wait(&farm, name), Some(code), "{}", farm.log());
        // A published copy may appear shortly after the answer, as after every verdict.
        let is_copy = output.starts_with(farm.gate());
        assert!(
            is_copy || output.exists(),
            "{} is missing",
            output.display()
        );
        there(&farm, &outputs(&farm));
    }
}

fn is_of_good(output: &Path) -> bool {
    let name = output.file_name().unwrap().to_string_lossy();
    name.starts_with("good.xodr.")
}

#[test]
fn changed_outputs_are_written_again() {
    let farm = farm();
    let _broker = serve(&farm);
    for output in outputs(&farm) {
        let before = std::fs::read(&output).unwrap();
        std::fs::write(&output, "another text").unwrap();
        let same = || {
            let now = std::fs::read(&output).unwrap_or_default();
            let is_copy = output.starts_with(farm.gate());
            (now.len() > 100 && (!is_copy || now == before)).then_some(())
        };
        until_or("the output is written again", same, || farm.log());
    }
}

#[test]
fn removed_result_directories_are_restored() {
    let farm = farm();
    let _broker = serve(&farm);
    std::fs::rename(farm.out().join("sub"), farm.base().join("elsewhere")).unwrap();
    there(&farm, &outputs(&farm));
    remove_whole(&farm.out().join("sub"));
    there(&farm, &outputs(&farm));
    assert_eq!(wait(&farm, "sub/bad.xodr"), Some(1));
}

#[test]
fn replaced_result_and_gate_directories_are_filled_again() {
    let farm = farm();
    let _broker = serve(&farm);
    for directory in [farm.out(), farm.gate()] {
        remove_whole(&directory);
        there(&farm, &outputs(&farm));
    }
    // The directories belong to this broker again.
    let mut other = Farm::new();
    other.arguments = farm.arguments.clone();
    let gate = farm.gate().to_string_lossy().into_owned();
    let state = other.base().join("state").to_string_lossy().into_owned();
    other.arguments = vec!["--gate".to_owned(), gate, "--state".to_owned(), state];
    let refused = other.serve_command().output().unwrap();
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("of another running broker"), "{said}");
}

#[test]
fn directory_taken_by_another_broker_is_left_to_it() {
    let mut other = Farm::new();
    let gate = other.gate().to_string_lossy().into_owned();
    other.arguments.extend(["--gate".to_owned(), gate]);
    let farm = farm();
    let _broker = serve(&farm);
    // The other broker owns the directory that replaces the gate of the first one.
    while std::os::unix::fs::symlink(other.gate(), farm.gate()).is_err() {
        remove_whole(&farm.gate());
    }
    other.write("other.xodr", &Content::Good(2).bytes());
    let _second = other.serve_ready();
    other.verdict("other.xodr");
    there(&other, &[other.gate().join("other.xodr")]);
    farm.write("late.xodr", &Content::Good(3).bytes());
    until_failing(&farm, "another running broker");
    let there: Vec<_> = std::fs::read_dir(other.gate()).unwrap().collect();
    assert_eq!(
        there.len(),
        2,
        "only its gate file and its published file: {there:?}"
    );
}

#[test]
fn removed_state_directory_is_reported() {
    let farm = farm();
    let _broker = serve(&farm);
    remove_whole(&farm.base().join("state"));
    until_failing(&farm, "was removed or replaced");
    let health = farm.qcbus(&["status", "--health"]);
    assert_eq!(health.status.code(), Some(1), "{health:?}");
    // The broker must still check files and answer.
    farm.write("late.xodr", &Content::Good(3).bytes());
    assert_eq!(wait(&farm, "late.xodr"), Some(0));
}

#[test]
fn removed_outputs_of_a_touched_file_are_written_again() {
    let farm = farm();
    let _broker = serve(&farm);
    for _ in 0..5 {
        for output in outputs(&farm) {
            // While a file is checked again, its copy is not behind the gate, so an error is
            // ignored.
            let _ = std::fs::remove_file(&output);
        }
        // The bytes are unchanged, so they alone cause no new check.
        let file = std::fs::File::options()
            .write(true)
            .open(farm.root().join("good.xodr"))
            .unwrap();
        file.set_modified(std::time::SystemTime::now()).unwrap();
        drop(file);
        there(&farm, &outputs(&farm));
    }
}
