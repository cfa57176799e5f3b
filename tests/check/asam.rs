//! Use like ASAM's framework: a configuration goes in, `Result.xqar` and reports come out, and
//! ASAM's own library reads them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::support::asam;
use crate::support::cli::{Cli, checkers, files_below, issues, read_result, sample_farm};
use crate::support::inside::skip;
use qcbus_formats::xqar::Results;

const IDS: &str = "check_asam_xodr_ids_id_unique_in_class";
const HEADER: &str = "check_qcbus_xodr_header_attributes";

/// Returns a configuration for a faulty map with two configured checkers and more children.
fn config(input: &Path, levels: &str, more: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Config>\n\
         <Param name=\"InputFile\" value=\"{}\"/>\n\
         <CheckerBundle application=\"xodrBundle\">\n\
         <Checker checkerId=\"{IDS}\" {levels}/>\n\
         <Checker checkerId=\"{HEADER}\" {levels}/>\n\
         </CheckerBundle>\n{more}</Config>\n",
        input.display()
    )
}

fn header_faults() -> PathBuf {
    sample_farm().join("faulty/header_faults.xodr")
}

const ALL: &str = "maxLevel=\"1\" minLevel=\"3\"";

#[test]
fn configuration_runs_only_the_named_checkers() {
    let cli = Cli::new();
    cli.write("config.xml", config(&header_faults(), ALL, ""));
    let said = cli.qcbus(&["check", "-c", "config.xml"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    let results = cli.result("Result.xqar");
    let bundles: Vec<&str> = results.bundles.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(bundles.first(), Some(&"xodrBundle"), "{bundles:?}");
    let configured: Vec<&str> = results.bundles[0]
        .checkers
        .iter()
        .map(|it| &*it.id)
        .collect();
    assert_eq!(
        configured,
        [IDS, HEADER],
        "in the order of the configuration"
    );
    assert!(
        bundles[1..].iter().all(|name| *name == "qcbus"),
        "{bundles:?}"
    );
    let written: Vec<PathBuf> = files_below(cli.path());
    assert!(
        written.iter().all(|it| it.starts_with(".run")
            || it.ends_with("Result.xqar")
            || it.ends_with("config.xml")),
        "{written:?}"
    );

    cli.qcbus(&["check", "-c", "config.xml", "--out", "elsewhere"]);
    let read = |name: &str| std::fs::read(cli.path().join(name)).unwrap();
    assert_eq!(read("Result.xqar"), read("elsewhere/Result.xqar"));
}

fn levels_kept(results: &Results) -> Vec<u8> {
    let ours = issues(results).filter(|(checker, _)| *checker.id == *HEADER);
    let mut levels: Vec<u8> = ours.map(|(_, issue)| issue.level as u8).collect();
    levels.sort_unstable();
    levels
}

#[test]
fn level_limits_may_be_in_either_order() {
    let kept = |levels: &str| {
        let cli = Cli::new();
        cli.write("config.xml", config(&header_faults(), levels, ""));
        cli.qcbus(&["check", "-c", "config.xml"]);
        let results = cli.result("Result.xqar");
        let old = checkers(&results).filter(|it| *it.id != *IDS && *it.id != *HEADER);
        let remarks = old
            .flat_map(|it| &it.issues)
            .map(|it| it.description.clone());
        (
            levels_kept(&results).len(),
            remarks.collect::<Vec<_>>().join("\n"),
        )
    };
    let (all, _) = kept(ALL);
    assert_eq!(all, 3, "two errors and a warning");
    let (old_order, remark) = kept("minLevel=\"1\" maxLevel=\"3\"");
    assert_eq!(old_order, 3);
    assert!(
        remark.contains("minLevel"),
        "the old order is reported: {remark}"
    );
    let (errors, remark) = kept("maxLevel=\"1\" minLevel=\"1\"");
    assert_eq!(errors, 2);
    assert!(
        remark.contains('1'),
        "the filtered issues are counted: {remark}"
    );
}

#[test]
fn report_modules_run_afterwards_with_their_params() {
    let cli = Cli::new();
    let (text, json) = (
        cli.path().join("r/report.txt"),
        cli.path().join("r/report.json"),
    );
    let modules = format!(
        "<ReportModule application=\"TextReport\"><Param name=\"OutputFile\" value=\"{}\"/></ReportModule>\n\
         <ReportModule application=\"qc-report-json\"><Param name=\"OutputFile\" value=\"{}\"/>\
         <Param name=\"Indent\" value=\"4\"/></ReportModule>\n",
        text.display(),
        json.display()
    );
    cli.write("config.xml", config(&header_faults(), ALL, &modules));
    let said = cli.qcbus(&["check", "-c", "config.xml"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    let text =
        std::fs::read_to_string(text).unwrap_or_else(|it| panic!("{it}\n{}", said.whole(&cli)));
    assert!(text.contains("there is a second `header`"), "{text}");
    let json = std::fs::read_to_string(json).unwrap();
    assert!(
        json.lines().any(|line| line.starts_with("    \"")),
        "the report is indented by 4: {json}"
    );
    let _: serde_json::Value = serde_json::from_str(&json).unwrap();
}

#[test]
fn malformed_configuration_is_refused_with_its_place() {
    let cli = Cli::new();
    // This is the mistake in an example of 2023: a letter outside the quotes.
    let broken = config(&header_faults(), ALL, "").replace("value=\"", "value=\"e\"");
    cli.write("config.xml", broken);
    for command in [
        &["check", "-c", "config.xml"][..],
        &["config", "check", "config.xml"],
    ] {
        let said = cli.qcbus(command);
        assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
        assert!(said.stderr.contains("config.xml:3:"), "{}", said.stderr);
    }
    assert!(!cli.path().join("Result.xqar").exists());
}

#[test]
fn unknown_names_are_warned_about_with_their_place() {
    let cli = Cli::new();
    let more = "<CheckerBundle application=\"xodrBundel\"><Checker checkerId=\"c\" maxLevel=\"1\" minLevel=\"3\"/></CheckerBundle>\n\
                <ReportModule application=\"GitforgeReport\"/>\n";
    cli.write(
        "config.xml",
        config(&header_faults(), ALL, more).replace(HEADER, "check_qcbus_xodr_header_atributes"),
    );
    let said = cli.qcbus(&["config", "check", "config.xml"]);
    assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
    for (name, row) in [
        ("check_qcbus_xodr_header_atributes", 6),
        ("xodrBundel", 8),
        ("GitforgeReport", 9),
    ] {
        let warned = said.stdout.lines().any(|line| {
            line.starts_with(&format!("config.xml:{row}:"))
                && line.contains(": warning: ")
                && line.contains(name)
        });
        assert!(warned, "{name}: {}", said.stdout);
    }
}

#[test]
fn bundle_runs_as_a_module_of_the_framework() {
    let cli = Cli::new();
    let with_file = config(&header_faults(), ALL, "").replace(
        "<Checker checkerId=\"check_asam",
        "<Param name=\"resultFile\" value=\"xodr.xqar\"/>\n<Checker checkerId=\"check_asam",
    );
    cli.write("config.xml", with_file);
    let said = cli.qcbus(&["bundle", "run", "xodr", "-c", "config.xml"]);
    assert!(said.code.is_some_and(|it| it <= 1), "{}", said.whole(&cli));
    let written = std::fs::read_to_string(cli.path().join("xodr.xqar")).unwrap();
    assert_eq!(asam::complaints(&written), [""; 0]);
    assert!(issues(&cli.result("xodr.xqar")).any(|(checker, _)| *checker.id == *HEADER));
}

/// Returns a Python with ASAM's library, or the reason why there is none.
fn python() -> Result<PathBuf, String> {
    let home = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("asam-venv");
    let python = home.join("bin/python");
    let run = |program: &Path, arguments: &[&str]| -> Result<(), String> {
        let mut command = Command::new(program);
        command
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let output = command
            .output()
            .map_err(|error| format!("{}: {error}", program.display()))?;
        let why = String::from_utf8_lossy(&output.stderr);
        output
            .status
            .success()
            .then_some(())
            .ok_or(why.trim().to_owned())
    };
    if run(&python, &["-c", "import qc_baselib"]).is_err() {
        run(
            Path::new("python3"),
            &["-m", "venv", &home.to_string_lossy()],
        )?;
        run(
            &python,
            &["-m", "pip", "install", "--quiet", "asam-qc-baselib==1.1.0"],
        )?;
    }
    Ok(python)
}

const READ: &str = "\
import sys
from qc_baselib import Result
for name in sys.argv[1:]:
    result = Result()
    result.load_from_file(name)
    for bundle in result.get_checker_bundle_results():
        for checker in bundle.checkers:
            print(bundle.name, checker.checker_id, checker.status.value, len(checker.issues))
";

#[test]
fn asam_library_reads_every_result() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => return skip("asam_library_reads_every_result", &why),
    };
    let cli = Cli::new();
    cli.check_in(&sample_farm(), &["."], "out");
    cli.write("config.xml", config(&header_faults(), ALL, ""));
    cli.qcbus(&["check", "-c", "config.xml"]);
    let files = files_below(&cli.path().join("out"));
    let mut files: Vec<PathBuf> = files
        .iter()
        .map(|file| cli.path().join("out").join(file))
        .collect();
    files.push(cli.path().join("Result.xqar"));
    let mut expected = String::new();
    for file in &files {
        for bundle in &read_result(file).bundles {
            for checker in &bundle.checkers {
                let status = checker.status.unwrap().as_str();
                expected.push_str(&format!(
                    "{} {} {status} {}\n",
                    bundle.name,
                    checker.id,
                    checker.issues.len()
                ));
            }
        }
    }
    let said = cli.run(Command::new(python).arg("-c").arg(READ).args(&files));
    assert_eq!(said.code, Some(0), "{}", said.stderr);
    assert_eq!(said.stdout, expected);
}
