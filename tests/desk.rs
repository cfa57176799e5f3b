//! What is typed at a desk must not succeed by doing nothing: bundles that cannot be added, removed
//! or found, and configurations that ask for what is not there.

mod support;

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Output;

use support::content::Content;
use support::desk::{Desk, Said};
use support::farm::Farm;
use support::watchdog;

/// A program that can be started and joins no bus.
fn idler(directory: &Path) -> String {
    let path = directory.join("idler");
    std::fs::write(&path, "#!/bin/sh\nexec sleep 600\n").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path.to_str().unwrap().to_owned()
}

fn refused(said: &Said, desk: &Desk, code: i32, words: &str) {
    assert_eq!(said.code, Some(code), "{}", said.whole(desk));
    assert!(said.stderr.contains(words), "{}", said.whole(desk));
}

fn told(said: &Output) -> (Option<i32>, String) {
    (
        said.status.code(),
        String::from_utf8_lossy(&said.stderr).into_owned(),
    )
}

#[test]
fn a_directory_of_bundles_that_is_not_there_is_refused() {
    let desk = Desk::new();
    desk.write("a.xodr", Content::Good(1).bytes());
    let words = "cannot take bundles from --bundles-d";
    let said = desk.qcbus(&["check", "a.xodr", "--bundles-d", "/nosuch"]);
    refused(&said, &desk, 2, words);
    let said = desk.qcbus(&["check", "a.xodr", "--bundles-d", "a.xodr"]);
    refused(&said, &desk, 2, words);
    let said = desk.qcbus(&["serve", ".", "--bundles-d", "/nosuch"]);
    refused(&said, &desk, 2, words);
    assert!(!desk.path().join("qcbus-out").exists());
}

#[test]
fn a_bundle_whose_program_cannot_be_run_is_not_added() {
    let desk = Desk::new();
    desk.write("notes", "no program");
    for program in [
        "/nosuch/bundle",
        "./notes",
        ".",
        "surely-no-program-of-PATH",
    ] {
        for offline in [&[][..], &["--offline"]] {
            let words = [&["bundle", "add", "mine", program][..], offline].concat();
            refused(&desk.qcbus(&words), &desk, 2, "cannot run");
        }
    }
    assert!(!desk.path().join("qcbus-out").exists());
}

#[test]
fn without_a_broker_a_bundle_is_added_and_removed_only_by_saying_so() {
    let desk = Desk::new();
    let program = idler(desk.path());
    let add = ["bundle", "add", "mine", &program, "--bundles-d", "d"];
    refused(&desk.qcbus(&add), &desk, 4, "nothing was done: no broker");
    assert!(!desk.path().join("d").exists());
    let said = desk.qcbus(&[&add[..], &["--offline"]].concat());
    assert_eq!(said.code, Some(0), "{}", said.whole(&desk));
    assert!(said.stderr.contains("no broker watches it now"));
    assert!(desk.path().join("d/mine.json").exists());

    let remove = ["bundle", "remove", "mine", "--bundles-d", "d"];
    refused(
        &desk.qcbus(&remove),
        &desk,
        4,
        "nothing was done: no broker",
    );
    assert!(desk.path().join("d/mine.json").exists());
    let offline = [&remove[..], &["--offline"]].concat();
    assert_eq!(desk.qcbus(&offline).code, Some(0));
    assert!(!desk.path().join("d/mine.json").exists());
    refused(
        &desk.qcbus(&offline),
        &desk,
        2,
        "no bundle `mine` was added",
    );
}

#[test]
fn a_program_is_written_by_its_whole_path() {
    let desk = Desk::new();
    idler(desk.path());
    let add = |program: &str| {
        let said = desk.qcbus(&["bundle", "add", "mine", program, "--offline"]);
        assert_eq!(said.code, Some(0), "{}", said.whole(&desk));
        let path = desk.path().join("qcbus-out/.qcbus/bundles.d/mine.json");
        let manifest: serde_json::Value =
            serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        manifest["module"][0]["exec_command"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let beside = desk.path().join("./idler");
    assert_eq!(Path::new(&add("./idler")), beside);
    let found = add("sh");
    assert!(found.starts_with('/') && found.ends_with("/sh"), "{found}");
}

#[test]
fn a_running_broker_takes_a_bundle_or_nothing_is_added() {
    let farm = Farm::new();
    let program = idler(farm.base());
    let elsewhere = farm.base().join("elsewhere");
    let _broker = farm.serve_ready();

    let elsewhere_named = elsewhere.to_string_lossy();
    let add = ["bundle", "add", "mine", &program];
    let (code, text) = told(&farm.qcbus(&[&add[..], &["--bundles-d", &elsewhere_named]].concat()));
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("watches"), "{text}");
    assert!(!elsewhere.exists());

    let (code, text) = told(&farm.qcbus(&add));
    assert_eq!(code, Some(0), "{text}");
    assert!(farm.bundles_d().join("mine.json").exists());
    // It has been taken before the command ends.
    let is_known = || {
        let status = farm.status().unwrap();
        status.peers.iter().any(|peer| peer.name == "mine")
    };
    assert!(is_known());

    let (code, text) = told(&farm.qcbus(&["bundle", "remove", "mine"]));
    assert_eq!(code, Some(0), "{text}");
    watchdog::until("the bundle has gone", || (!is_known()).then_some(()));
    for name in ["mine", "nobody", "xodrBundle"] {
        let (code, text) = told(&farm.qcbus(&["bundle", "remove", name]));
        assert_eq!(code, Some(2), "{name}: {text}");
    }

    // One bad manifest keeps the broker from taking any.
    std::fs::write(farm.bundles_d().join("broken.json"), "{").unwrap();
    let (code, text) = told(&farm.qcbus(&add));
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("nothing was added") && text.contains("broken.json"),
        "{text}"
    );
    assert!(!farm.bundles_d().join("mine.json").exists());
}
