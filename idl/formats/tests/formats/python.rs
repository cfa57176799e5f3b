//! Tests that ASAM's own Python library can read the written files. They need `python3` and the
//! package `asam-qc-baselib`. If one of them is not available, they print a message and are
//! skipped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{bundle, checker, full, input, issue, xml_place};
use qcbus_formats::config::Config;
use qcbus_formats::pool::{NoPlaces, PoolInput, pool};
use qcbus_formats::xqar::{Dialect, Level, Results, write};

const SCRIPT: &str = r"
import sys
from qc_baselib import Result
for path in sys.argv[1:]:
    result = Result()
    result.load_from_file(path)
    for bundle in result.get_checker_bundle_names():
        for checker in result.get_checker_ids(bundle):
            for issue in result.get_issues(bundle, checker):
                print(bundle, checker, issue.issue_id, issue.level.value, issue.rule_uid,
                      len(issue.locations), sep='|')
";

/// Returns the interpreter of a virtual environment with the package, or the reason why there is
/// none.
fn interpreter() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("baselib");
    let python = folder.join("bin/python");
    if run(Command::new(&python).args(["-c", "import qc_baselib"])).is_ok() {
        return Ok(python);
    }
    // Remains of an interrupted run are deleted, and the environment is built again.
    let parent = folder.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(parent).map_err(|error| error.to_string())?;
    run(Command::new("python3")
        .args(["-m", "venv", "--clear"])
        .arg(&folder))?;
    let install = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ];
    run(Command::new(&python).args(install).args([
        "--retries",
        "0",
        "--timeout",
        "20",
        "asam-qc-baselib==1.1.0",
    ]))?;
    Ok(python)
}

fn run(command: &mut Command) -> Result<String, String> {
    let output = command
        .output()
        .map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!(
            "{command:?}: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        ))
    }
}

/// Returns results that cover the strict checks of the library.
fn results() -> Vec<Results> {
    let text = "<Config><CheckerBundle application='b'><Checker checkerId='c' minLevel='1' \
                maxLevel='2'/><Checker checkerId='gone'/></CheckerBundle>\
                <CheckerBundle application='away'/></Config>";
    let config = Config::parse(text.as_bytes()).unwrap().config;
    let mut odd = issue(
        Level::Error,
        "tab\t, line\n, bell\u{7}, <&\"'>, Straße, 道路, 🚗",
    );
    odd.rule_uid = "no rule at all".into();
    odd.locations = vec![
        xml_place("/a[@b=\"c\"]"),
        qcbus_formats::xqar::Locations::default(),
    ];
    let mut silent = checker("c", vec![odd, issue(Level::Information, "removed")]);
    silent.ending = None;
    let input = PoolInput {
        config: Some(&config),
        ..input(vec![bundle("b", "b", vec![silent])])
    };
    vec![
        full(),
        pool(input, &mut NoPlaces).results,
        Results::default(),
    ]
}

#[test]
fn asam_python_library_reads_written_results() {
    let python = match interpreter() {
        Ok(python) => python,
        Err(why) => {
            println!("skipped: no Python with asam-qc-baselib here: {why}");
            return;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let mut paths = Vec::new();
    let mut expected = String::new();
    for (i, results) in results().iter().enumerate() {
        let path = folder.path().join(format!("{i}.xqar"));
        fs::write(&path, write(results, Dialect::Current)).unwrap();
        paths.push(path);
        for bundle in &results.bundles {
            for checker in &bundle.checkers {
                for issue in &checker.issues {
                    let (level, places) = (issue.level as u8, issue.locations.len());
                    let places = if issue.description.starts_with("road 5") {
                        1
                    } else {
                        places
                    };
                    expected += &format!(
                        "{}|{}|{}|{level}|{}|{places}\n",
                        bundle.name, checker.id, issue.id, issue.rule_uid
                    );
                }
            }
        }
    }
    let seen = run(Command::new(python).args(["-c", SCRIPT]).args(&paths)).unwrap();
    assert_eq!(seen, expected);
}
