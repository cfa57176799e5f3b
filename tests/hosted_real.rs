//! ASAM's own modules, hosted, say what they say by themselves.

#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot go on fails where it stands"
)]

mod support;

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use qcbus_formats::xqar::{CheckerBundle, Location, Locations, Status};
use support::asam_venv;
use support::desk::{Desk, files_below, read_result};
use support::inside::skip;

/// Of all cases so many are tried, evenly spread, unless `QCBUS_ALL_CASES` is set.
const SOME: usize = 13;

/// A module of ASAM's: program, name in its code, kind of files.
const MODULES: [(&str, &str, &str); 2] = [
    ("qc_opendrive", "xodrBundle", "xodr"),
    ("qc_openscenario", "xoscBundle", "xosc"),
];

/// What a checker says: its status and what it found.
type Said = BTreeSet<(String, String, String)>;

/// What a bundle says. Pooling adds rows and columns to places that have none, so that those are left out.
fn said(bundle: &CheckerBundle) -> Said {
    let mut all = Said::new();
    for checker in &bundle.checkers {
        let id = checker.id.to_string();
        let status = match checker.status {
            // With a reason that is no answer, pooling says the same of both.
            Some(Status::Skipped) => "skipped".to_owned(),
            other => format!("{other:?}"),
        };
        all.insert((id.clone(), status, String::new()));
        for issue in &checker.issues {
            let places: Vec<String> = issue.locations.iter().map(place).collect();
            let what = format!("{:?} {} {}", issue.level, issue.rule_uid, issue.description);
            all.insert((id.clone(), what, places.join("; ")));
        }
    }
    all
}

fn place(locations: &Locations) -> String {
    let is_added = |it: &&Location| !matches!(it, Location::File { .. });
    let places: Vec<String> = locations
        .places
        .iter()
        .filter(is_added)
        .map(|it| format!("{it:?}"))
        .collect();
    format!("{} {}", locations.description, places.join(" "))
}

/// What a module says of a file when it is run by hand.
fn alone(
    desk: &Desk,
    programs: &Path,
    (program, name, _): (&str, &str, &str),
    file: &Path,
) -> Said {
    let directory = desk.path().join("alone");
    std::fs::create_dir_all(&directory).unwrap();
    let config = directory.join("config.xml");
    let text = format!(
        "<Config><Param name=\"InputFile\" value=\"{}\"/><CheckerBundle application=\"{name}\">\
         <Param name=\"resultFile\" value=\"own.xqar\"/></CheckerBundle></Config>",
        file.display()
    );
    std::fs::write(&config, text).unwrap();
    let result = directory.join("own.xqar");
    let _ = std::fs::remove_file(&result);
    let output = Command::new(programs.join(program))
        .arg("-c")
        .arg(&config)
        .current_dir(&directory)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}: {output:?}", file.display());
    said(&read_result(&result).bundles[0])
}

#[test]
fn hosted_modules_say_what_they_say_by_themselves() {
    let test = "hosted_modules_say_what_they_say_by_themselves";
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases/asam");
    if !cases.is_dir() {
        return skip(test, "there is no ../shared/cases/asam");
    }
    let programs = match asam_venv::programs() {
        Ok(programs) => programs,
        Err(why) => return skip(test, &format!("ASAM's modules cannot be installed: {why}")),
    };
    let desk = Desk::new();
    for file in files_below(&cases) {
        let bytes = std::fs::read(cases.join(&file)).unwrap();
        desk.write(&format!("cases/{}", file.display()), bytes);
    }
    let modules = MODULES.map(|(program, name, _)| {
        serde_json::json!({
            "name": name,
            "exec_type": "executable",
            "module_type": "checker_bundle",
            "exec_command": format!("{program} -c $ASAM_QC_FRAMEWORK_CONFIG_FILE"),
        })
    });
    desk.write(
        "bundles.d/asam.json",
        serde_json::json!({ "module": modules }).to_string(),
    );
    let inputs = inputs(&desk);
    let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus"));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path: OsString =
        std::env::join_paths(std::iter::once(programs.clone()).chain(std::env::split_paths(&path)))
            .unwrap();
    command.env("PATH", path);
    command
        .args(["check", "--bundles-d", "bundles.d", "--out", "out"])
        .args(&inputs);
    let whole = desk.run(&mut command);
    let mut differences = Vec::new();
    for input in &inputs {
        let ending = input.extension().unwrap().to_string_lossy().into_owned();
        let module = MODULES
            .into_iter()
            .find(|(.., kind)| *kind == ending)
            .unwrap();
        let result = desk
            .path()
            .join("out")
            .join(format!("{}.xqar", input.display()));
        let results = read_result(&result);
        let name = format!("asam.{}", module.1);
        let hosted = results.bundles.iter().find(|it| it.name == name);
        let mut hosted = said(hosted.unwrap_or_else(|| panic!("{}", whole.whole(&desk))));
        // The checker of ours is none of the module's.
        hosted.retain(|(id, ..)| id != "check_qcbus_asam_module_is_known");
        let alone = alone(&desk, &programs, module, &desk.path().join(input));
        for (one, other, what) in [(&hosted, &alone, "hosted"), (&alone, &hosted, "alone")] {
            for it in one.difference(other) {
                differences.push(format!("{}: only {what}: {it:?}", input.display()));
            }
        }
    }
    assert!(
        differences.is_empty(),
        "{} of {} inputs:\n{}",
        differences.len(),
        inputs.len(),
        differences.join("\n")
    );
}

/// The files that are tried.
fn inputs(desk: &Desk) -> Vec<PathBuf> {
    let root = desk.path().join("cases");
    let mut all: Vec<PathBuf> = files_below(&root)
        .into_iter()
        .map(|it| Path::new("cases").join(it))
        .filter(|it| {
            MODULES
                .iter()
                .any(|(.., kind)| it.extension().is_some_and(|e| e == *kind))
        })
        .collect();
    all.sort();
    assert!(all.len() > SOME, "{all:?}");
    if std::env::var_os("QCBUS_ALL_CASES").is_some() {
        return all;
    }
    let step = all.len().div_ceil(SOME);
    all.into_iter().step_by(step).collect()
}
