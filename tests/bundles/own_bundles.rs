//! The user's own bundles on a running broker: added, upgraded, removed. The answers are true.

use std::path::{Path, PathBuf};

use crate::support::cli::Cli;
use crate::support::content::Content;
use crate::support::farm::{Farm, zoo};
use crate::support::programs::{install_script, told};
use crate::support::watchdog::until_or;
use qcbus_formats::xqar::Status;
use qcbus_messages::Verdict;

const POLITE: [&str; 2] = [
    "check_polite_root_has_children",
    "check_polite_no_blank_values",
];

fn install(path: &Path, text: &str) {
    install_script(path, &format!("#!/bin/sh\n{text}\n"));
}

/// Returns a bundle called `mine` with a version.
fn mine(version: &str) -> String {
    let zoo = zoo();
    format!(
        "exec {} polite --name mine --version {version} \"$@\"",
        zoo.display()
    )
}

/// Creates a farm with the program of `mine` beside it.
fn farm_with_mine(version: &str) -> (Farm, PathBuf) {
    let farm = Farm::with(&["--absence-limit", "1s"]);
    let program = farm.base().join("mine");
    install(&program, &mine(version));
    (farm, program)
}

/// Writes a file and returns the checkers of a bundle in its result, with the bundle's version.
fn judges(farm: &Farm, bundle: &str, number: u64) -> Option<(String, Vec<String>)> {
    let name = format!("{number}.xodr");
    farm.write(&name, &Content::Good(number).bytes());
    assert_eq!(farm.verdict(&name).verdict, Verdict::Accepted, "{name}");
    let results = farm.result(&name);
    let bundle = results.bundles.iter().find(|it| it.name == bundle)?;
    let completed = |it: &&qcbus_formats::xqar::Checker| it.status == Some(Status::Completed);
    let checkers = bundle.checkers.iter().filter(completed);
    let ids = checkers.map(|it| it.id.to_string()).collect();
    Some((bundle.version.to_string(), ids))
}

fn polite(version: &str) -> Option<(String, Vec<String>)> {
    Some((version.to_owned(), POLITE.map(str::to_owned).to_vec()))
}

fn add(farm: &Farm, name: &str, program: &Path, more: &[&str]) -> (Option<i32>, String) {
    let program = program.to_str().unwrap();
    told(&farm.qcbus(&[&["bundle", "add", name, program], more].concat()))
}

fn upgrade(farm: &Farm, more: &[&str]) -> (Option<i32>, String) {
    told(&farm.qcbus(&[&["bundle", "upgrade", "mine"], more].concat()))
}

#[test]
fn bundle_reported_as_ready_judges_the_next_file() {
    let (farm, program) = farm_with_mine("1.0.0");
    let _broker = farm.serve_ready();
    for round in 1..4 {
        let (code, text) = add(&farm, "mine", &program, &[]);
        assert_eq!(code, Some(0), "{text}");
        assert!(
            text.contains("mine: ready, 2 checkers (xodr, xosc)"),
            "{text}"
        );
        assert_eq!(judges(&farm, "mine", round * 2), polite("1.0.0"));
        let (code, text) = told(&farm.qcbus(&["bundle", "remove", "mine"]));
        assert_eq!(code, Some(0), "{text}");
        assert_eq!(judges(&farm, "mine", round * 2 + 1), None);
    }
}

#[test]
fn bundle_that_does_not_become_ready_is_removed_again() {
    let (farm, program) = farm_with_mine("1.0.0");
    let _broker = farm.serve_ready();
    let cases = [
        ("exit 3", "exit code 3", 2),
        ("exec /nowhere/at/all", "127", 2),
        ("exec sleep 600", "it did not connect within 1 s", 3),
        // It says hello under a name that differs from its manifest.
        (&mine("1.0.0").replace("--name mine", "--name other"), "", 2),
    ];
    for (number, (script, why, expected)) in (0..).zip(cases) {
        install(&program, script);
        let (code, text) = add(&farm, "mine", &program, &["--timeout", "1s"]);
        // On a slow machine the timeout may expire before the program has ended.
        assert!(
            code == Some(expected) || code == Some(3),
            "{script}: {text}"
        );
        assert!(text.contains("`mine` is not ready"), "{script}: {text}");
        assert!(text.contains(why) || code == Some(3), "{script}: {text}");
        assert!(text.contains("it was removed again"), "{script}: {text}");
        assert!(!farm.bundles_d().join("mine.json").exists());
        assert_eq!(
            judges(&farm, "mine", number),
            None,
            "the bundle is not required"
        );
    }
}

#[test]
fn bundle_added_with_keep_stays_although_it_fails() {
    let (farm, program) = farm_with_mine("1.0.0");
    install(&program, "exit 3");
    let _broker = farm.serve_ready();
    let (code, text) = add(&farm, "mine", &program, &["--keep"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("qcbus bundle remove mine"), "{text}");
    farm.write("a.xodr", &Content::Good(1).bytes());
    assert_eq!(farm.verdict("a.xodr").verdict, Verdict::Undetermined);
    // A better program at the same path is noticed without a command.
    install(&program, &mine("1.0.1"));
    until_or(
        "the better program judges",
        || (farm.verdict("a.xodr").verdict == Verdict::Accepted).then_some(()),
        || farm.log(),
    );
    assert_eq!(judges(&farm, "mine", 2), polite("1.0.1"));
}

#[test]
fn upgrade_reports_the_old_and_the_new_version() {
    let (farm, program) = farm_with_mine("1.0.0");
    let _broker = farm.serve_ready();
    let (code, text) = upgrade(&farm, &[]);
    assert_eq!(code, Some(2), "there is no bundle to upgrade yet: {text}");
    assert_eq!(add(&farm, "mine", &program, &[]).0, Some(0));
    let (code, text) = upgrade(&farm, &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("nothing has changed"), "{text}");

    let other = farm.base().join("other");
    install(&other, &mine("2.0.0"));
    let (code, text) = upgrade(&farm, &[other.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{text}");
    let expected = "mine: ready, 2 checkers (xodr, xosc) (was 2, version 1.0.0 -> 2.0.0)";
    assert!(text.contains(expected), "{text}");
    assert_eq!(judges(&farm, "mine", 1), polite("2.0.0"));
}

#[test]
fn replaced_program_is_noticed_automatically() {
    let (farm, program) = farm_with_mine("1.0.0");
    let _broker = farm.serve_ready();
    assert_eq!(add(&farm, "mine", &program, &[]).0, Some(0));
    assert_eq!(judges(&farm, "mine", 1), polite("1.0.0"));
    install(&program, &mine("2.0.0"));
    // Files judged by the previous program are judged again.
    until_or(
        "the newer program has judged it again",
        || {
            let results = farm.result("1.xodr");
            let mine = results.bundles.iter().find(|it| it.name == "mine")?;
            (*mine.version == *"2.0.0").then_some(())
        },
        || farm.log(),
    );
    assert_eq!(judges(&farm, "mine", 2), polite("2.0.0"));
}

#[test]
fn upgrade_to_a_broken_program_keeps_the_working_one() {
    let (farm, program) = farm_with_mine("1.0.0");
    let _broker = farm.serve_ready();
    assert_eq!(add(&farm, "mine", &program, &[]).0, Some(0));
    let pid = || {
        let peers = farm.status().unwrap().peers;
        peers.iter().find(|it| it.name == "mine").map(|it| it.pid)
    };
    let before = pid();
    let manifest = || std::fs::read_to_string(farm.bundles_d().join("mine.json")).unwrap();
    let written = manifest();

    // Both commands get another program. Neither answer is about the process that goes on.
    let broken = farm.base().join("broken");
    install(&broken, "exit 3");
    let (code, text) = upgrade(&farm, &[broken.to_str().unwrap()]);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("exit code 3") && text.contains("the previous process continues"),
        "{text}"
    );
    assert_eq!(manifest(), written);
    let (code, text) = add(&farm, "mine", &broken, &[]);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("its previous manifest is in force again"),
        "{text}"
    );
    assert_eq!(manifest(), written);
    assert_eq!(judges(&farm, "mine", 1), polite("1.0.0"));
    assert_eq!(pid(), before, "the process was not restarted");

    // The broken program is at the same path.
    install(&program, "exit 4");
    let (code, text) = upgrade(&farm, &[]);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("exit code 4") && text.contains("the previous process continues"),
        "{text}"
    );
    assert_eq!(judges(&farm, "mine", 2), polite("1.0.0"));
    assert_eq!(pid(), before);
    install(&program, &mine("3.0.0"));
    let (code, text) = upgrade(&farm, &[]);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(judges(&farm, "mine", 3), polite("3.0.0"));
}

#[test]
fn several_bundles_are_added_at_once() {
    let farm = Farm::new();
    let _broker = farm.serve_ready();
    let names = ["one", "two", "three"];
    std::thread::scope(|scope| {
        let farm = &farm;
        for name in names {
            scope.spawn(move || {
                let program = farm.base().join(name);
                install(
                    &program,
                    &mine("1.0.0").replace("--name mine", &format!("--name {name}")),
                );
                let (code, text) = add(farm, name, &program, &[]);
                assert_eq!(code, Some(0), "{text}");
            });
        }
    });
    assert!(judges(&farm, "one", 1).is_some());
    for (number, name) in (2..).zip(names) {
        assert_eq!(judges(&farm, name, number), polite("1.0.0"), "{name}");
    }
}

#[test]
fn unconfigured_bundle_is_ready_but_not_used() {
    let (mut farm, program) = farm_with_mine("1.0.0");
    let config = farm.base().join("config.xml");
    std::fs::write(
        &config,
        "<Config><CheckerBundle application=\"xodrBundle\"/></Config>",
    )
    .unwrap();
    farm.arguments
        .extend(["-c".to_owned(), config.display().to_string()]);
    let _broker = farm.serve_ready();
    let (code, text) = add(&farm, "mine", &program, &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("ready, 2 checkers") && text.contains("none of its checkers runs"),
        "{text}"
    );
    assert_eq!(judges(&farm, "mine", 1), None);
}

#[test]
fn rules_of_every_running_bundle_are_known() {
    let (farm, program) = farm_with_mine("1.0.0");
    let rule = |more: &[&str]| told(&farm.qcbus(&[&["rule"], more].concat()));
    let (code, text) = rule(&[POLITE[0]]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("no broker runs"), "{text}");
    let _broker = farm.serve_ready();
    let (code, text) = rule(&[POLITE[0]]);
    assert!(
        code == Some(2) && !text.contains("no broker runs"),
        "{text}"
    );
    assert_eq!(add(&farm, "mine", &program, &[]).0, Some(0));
    for name in [
        POLITE[0],
        "root_has_children",
        "example.org:xodr:1.0.0:polite.root_has_children",
    ] {
        let (code, text) = rule(&[name]);
        assert_eq!(code, Some(0), "{text}");
        assert!(
            text.contains("level warning") && text.contains("bundle mine 1.0.0"),
            "{text}"
        );
    }
    let (_, text) = rule(&[]);
    let listed = |name: &str| text.lines().any(|it| it.starts_with(name));
    assert!(POLITE.iter().all(|it| listed(it)), "{text}");
    assert!(text.lines().any(|it| it.ends_with("(mine)")), "{text}");
    let (_, json) = rule(&["--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let mut rules = json.as_array().unwrap().iter();
    assert!(rules.any(|it| it["id"] == POLITE[1] && it["bundle"] == "mine"));
}

#[test]
fn python_script_is_run_by_the_interpreter_on_path() {
    let cli = Cli::new();
    let script = cli.write("rules.py", "pass\n");
    let said = cli.qcbus(&["bundle", "add", "mine", "rules.py", "--offline"]);
    if said.stderr.contains("not found in PATH") {
        println!("skipped: there is no python3 here");
        return;
    }
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let command = cli.command_in("qcbus-out/.qcbus/bundles.d/mine.json");
    let (interpreter, file) = command.split_once(' ').unwrap();
    assert!(
        interpreter.starts_with('/') && interpreter.ends_with("/python3"),
        "{command}"
    );
    assert_eq!(Path::new(file), script);
    let missing = cli.qcbus(&["bundle", "add", "other", "none.py", "--offline"]);
    assert_eq!(missing.code, Some(2), "{}", missing.whole(&cli));
}

/// The test works like an outside user: outside of the workspace, as the command instructs.
#[test]
fn new_rust_bundle_is_built_tested_and_judges() {
    let farm = Farm::new();
    let outside = farm.base().join("outside");
    std::fs::create_dir(&outside).unwrap();
    let new = |name: &str| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_qcbus"));
        command.args(["bundle", "new", name, "--rust"]);
        told(&command.current_dir(&outside).output().unwrap())
    };
    let (code, text) = new("mine");
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = new("mine");
    assert_eq!(code, Some(2), "no file is overwritten: {text}");
    // In the target directory of the workspace, most dependencies are built already.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    let cargo = |words: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO"));
        command.args(words).arg("--offline");
        command.env("CARGO_TARGET_DIR", target);
        command.envs([
            ("CARGO_PROFILE_DEV_DEBUG", "none"),
            ("CARGO_INCREMENTAL", "0"),
        ]);
        let (code, text) = told(&command.current_dir(outside.join("mine")).output().unwrap());
        assert_eq!(code, Some(0), "{text}");
        text
    };
    let text = cargo(&["test"]);
    assert!(text.contains("pages_keep_their_word ... ok"), "{text}");
    cargo(&["build"]);
    let _broker = farm.serve_ready();
    let (code, text) = add(&farm, "mine", &target.join("debug/mine"), &[]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("mine: ready, 1 checker (xodr)"), "{text}");
    let checkers = vec!["check_mine_driving_lane_width".to_owned()];
    assert_eq!(
        judges(&farm, "mine", 1),
        Some(("0.1.0".to_owned(), checkers))
    );
}
