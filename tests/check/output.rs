//! Further output of `qcbus check` besides results, and its exit codes.

use crate::support::cli::{Cli, Said, checkers, files_below, issues, sample_farm};
use crate::support::content::Content;

fn cli() -> Cli {
    let cli = Cli::new();
    cli.write("in/good.xodr", Content::Good(1).bytes());
    cli.write("in/bad.xodr", Content::NoHeader(1).bytes());
    cli
}

fn read(cli: &Cli, name: &str) -> String {
    let path = cli.path().join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn last_line(said: &Said) -> &str {
    said.stdout.lines().last().unwrap_or_default()
}

#[test]
fn single_file_is_shown_in_full_several_in_lines() {
    let cli = cli();
    let one = cli.qcbus(&["check", "in/bad.xodr"]);
    assert!(
        one.stdout.starts_with("error[xml.fileheader_is_present]: "),
        "{}",
        one.stdout
    );
    assert!(
        one.stdout.contains(" --> in/bad.xodr:2:1\n"),
        "{}",
        one.stdout
    );
    let two = cli.qcbus(&["check", "in"]);
    assert!(
        two.stdout.starts_with("in/bad.xodr:2:1: error: "),
        "{}",
        two.stdout
    );
    let full = cli.qcbus(&["check", "in", "--output-format", "full"]);
    assert!(
        full.stdout.contains(" --> in/bad.xodr:2:1\n"),
        "{}",
        full.stdout
    );
    let good = cli.qcbus(&["check", "in/good.xodr"]);
    assert_eq!(
        good.stdout,
        "0 errors, 0 warnings in 0 of 1 file; 1 accepted; results in qcbus-out\n"
    );
}

#[test]
fn concise_lines_match_a_problem_matcher() {
    let cli = cli();
    let said = cli.qcbus(&["check", "in", "--output-format", "concise", "-q"]);
    for line in said.stdout.lines() {
        // docs/ci.md promises this format to editors: PATH:ROW:COLUMN: LEVEL: TEXT [RULE]
        let (place, rest) = line.split_once(": ").unwrap();
        let parts: Vec<&str> = place.rsplitn(3, ':').collect();
        assert!(
            parts[0].parse::<u64>().is_ok() && parts[1].parse::<u64>().is_ok(),
            "{line}"
        );
        assert!(
            cli.path().join(parts[2]).is_file(),
            "the place must name an existing file: {line}"
        );
        let (level, text) = rest.split_once(": ").unwrap();
        assert!(
            ["error", "warning", "information"].contains(&level),
            "{line}"
        );
        assert!(text.ends_with(']') && text.contains(" ["), "{line}");
    }
    assert_eq!(said.stdout.lines().count(), 1);
}

#[test]
fn paths_are_relative_to_the_current_directory() {
    let cli = cli();
    let absolute = cli.path().canonicalize().unwrap().join("in/bad.xodr");
    let said = cli.qcbus(&["check", &absolute.to_string_lossy(), "--format", "concise"]);
    assert!(
        said.stdout.starts_with("in/bad.xodr:2:1: "),
        "{}",
        said.stdout
    );
}

#[test]
fn several_formats_are_written_to_separate_files() {
    let cli = cli();
    let formats = "sarif=r/all.sarif,junit=r/all.xml,gitlab=r/all.json,json=r/lines.json,\
                   concise=r/all.txt,html=r/all.html,github";
    let said = cli.qcbus(&["check", "in", "--output-format", formats]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    assert!(
        said.stdout.contains("::error file=in/bad.xodr,line=2"),
        "{}",
        said.stdout
    );
    assert!(said.stderr.contains("1 rejected"), "{}", said.whole(&cli));
    let sarif: serde_json::Value = serde_json::from_str(&read(&cli, "r/all.sarif")).unwrap();
    assert_eq!(sarif["runs"].as_array().unwrap().len(), 1);
    assert!(!sarif["runs"][0]["results"].as_array().unwrap().is_empty());
    let issues: serde_json::Value = serde_json::from_str(&read(&cli, "r/all.json")).unwrap();
    assert_eq!(issues[0]["location"]["path"], "in/bad.xodr");
    assert!(read(&cli, "r/all.xml").contains("<failure"));
    assert_eq!(
        read(&cli, "r/lines.json").matches("\"resultFile\"").count(),
        2
    );
    assert!(read(&cli, "r/all.txt").starts_with("in/bad.xodr:2:1: error: "));
    assert!(read(&cli, "r/all.html").contains("Content-Security-Policy"));
    let mut pages = files_below(&cli.path().join("r/all-files"));
    pages.sort();
    let expected = ["in/bad.xodr.html", "in/good.xodr.html"].map(std::path::PathBuf::from);
    assert_eq!(pages, expected);
}

#[test]
fn page_of_a_single_file_needs_no_other_pages() {
    let cli = cli();
    let said = cli.qcbus(&["check", "in/bad.xodr", "--output-format", "html"]);
    assert_eq!(said.code, Some(1));
    assert!(
        last_line(&said).ends_with("report in qcbus-out/report.html"),
        "{}",
        said.stdout
    );
    assert!(read(&cli, "qcbus-out/report.html").contains("bad.xodr"));
    assert!(!cli.path().join("qcbus-out/report-files").exists());
}

#[test]
fn unwritable_output_is_reported_before_any_check() {
    let cli = cli();
    cli.write("file", "");
    for (format, words) in [
        ("sarif,junit", "cannot both be printed"),
        ("sarif=file/x.sarif", "file"),
        ("sarif=in", "name a file"),
        ("sarif=", "name a file"),
        ("serif=x", "serif"),
    ] {
        let said = cli.qcbus(&["check", "in", "--output-format", format]);
        assert_eq!(said.code, Some(2), "{format}: {}", said.whole(&cli));
        assert!(said.stderr.contains(words), "{format}: {}", said.stderr);
        assert!(said.stdout.is_empty(), "{format}: {}", said.stdout);
        assert!(!cli.path().join("qcbus-out").exists(), "{format}");
    }
}

#[test]
fn ignored_rules_are_named_in_output_and_result() {
    let cli = Cli::new();
    let (farm, file) = (sample_farm(), "faulty/dangling_links.xodr");
    let rule = "ids.only_ref_defined_ids";
    let said = cli.check_in(&farm, &[file, "--ignore", rule], "out");
    let whole = said.whole(&cli);
    assert!(!said.stdout.contains("elementId"), "{whole}");
    assert!(
        said.stdout
            .contains("not requested, so the verdicts do not cover it: 2 of"),
        "{whole}"
    );
    let results = cli.result(&format!("out/{file}.xqar"));
    let said = issues(&results).find(|(checker, _)| &*checker.id == "qcbus_choice");
    let text = &said.unwrap().1.description;
    assert!(
        text.contains("`--ignore ids.only_ref_defined_ids`"),
        "{text}"
    );
}

#[test]
fn select_runs_only_the_selected_rules() {
    let cli = cli();
    let said = cli.qcbus(&["check", "in/good.xodr", "--select", "ids"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    let results = cli.result("qcbus-out/in/good.xodr.xqar");
    let asked = checkers(&results).map(|checker| &*checker.id);
    let asked: Vec<&str> = asked.filter(|id| *id != "qcbus_choice").collect();
    let only = asked.iter().all(|id| id.contains("_ids_"));
    assert!(!asked.is_empty() && only, "{asked:?}");
}

#[test]
fn check_without_a_selected_rule_accepts_nothing() {
    let cli = cli();
    let said = cli.qcbus(&["check", "in/good.xodr", "--select", "xosc"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
}

#[test]
fn preconditions_cannot_be_ignored() {
    let cli = cli();
    cli.write("torn.xodr", "<OpenDRIVE><road>");
    let said = cli.qcbus(&["check", "torn.xodr", "--ignore", "xml.valid_xml_document"]);
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
}

#[test]
fn unknown_rule_name_is_an_error() {
    let cli = cli();
    for flag in ["--select", "--ignore"] {
        let said = cli.qcbus(&["check", "in", flag, "ids,xml.fileheader_is_presnt"]);
        assert_eq!(said.code, Some(2), "{}", said.whole(&cli));
        assert!(
            said.stderr
                .contains("did you mean `xml.fileheader_is_present`?"),
            "{}",
            said.stderr
        );
    }
}

#[test]
fn exit_code_follows_the_options() {
    let cli = cli();
    let farm = sample_farm();
    let convoy = "modular/convoy.xosc";
    let code = |arguments: &[&str]| {
        let mut all = vec![convoy];
        all.extend(arguments);
        cli.check_in(&farm, &all, "out").code
    };
    assert_eq!(code(&[]), Some(0));
    assert_eq!(code(&["--fail-level", "warning"]), Some(1));
    assert_eq!(code(&["--fail-level", "warning", "--exit-zero"]), Some(0));
    let bad = cli.qcbus(&["check", "in/bad.xodr", "--exit-zero"]);
    assert_eq!(bad.code, Some(0));
    assert!(
        last_line(&bad).contains("1 rejected"),
        "the verdict is unchanged: {}",
        bad.stdout
    );
    let nobody = cli.qcbus(&["check", "in/good.xodr", "--exit-zero", "--select", "xosc"]);
    assert_eq!(nobody.code, Some(3), "an unchecked file is not a finding");
}

#[test]
fn quiet_output_keeps_every_finding() {
    let cli = cli();
    let loud = cli.qcbus(&["check", "in", "--format", "concise"]);
    let quiet = cli.qcbus(&["check", "in", "--format", "concise", "-q"]);
    assert!(loud.stdout.starts_with(&quiet.stdout) && !quiet.stdout.is_empty());
    assert_eq!(quiet.stderr, "");
    let good = cli.qcbus(&["check", "in/good.xodr", "-q"]);
    assert_eq!((good.stdout.as_str(), good.stderr.as_str()), ("", ""));
}

#[test]
fn verbose_output_explains_skipped_checkers() {
    let cli = cli();
    let said = cli.qcbus(&["check", "in", "-v"]);
    for words in [
        "accepted: in/good.xodr",
        "skipped",
        "sha256: ",
        "(xodrBundle/",
    ] {
        assert!(said.stdout.contains(words), "{words}: {}", said.stdout);
    }
    let plain = cli.qcbus(&["check", "in"]);
    assert!(!plain.stdout.contains("skipped"), "{}", plain.stdout);
}

#[test]
fn colours_follow_the_option() {
    let cli = cli();
    let coloured = |when: &str| {
        let said = cli.qcbus(&["check", "in", "--color", when]);
        said.stdout.contains("\u{1b}[")
    };
    assert!(coloured("always"));
    assert!(!coloured("never"));
    assert!(!coloured("auto"), "the output is not a terminal");
}

#[test]
fn inputs_with_the_same_name_get_separate_results() {
    let cli = cli();
    cli.write("a/m.xodr", Content::Good(1).bytes());
    cli.write("b/m.xodr", Content::NoHeader(1).bytes());
    let said = cli.qcbus(&["check", "a/m.xodr", "b/m.xodr", "--format", "html"]);
    assert_eq!(said.code, Some(1));
    let files = files_below(&cli.path().join("qcbus-out"));
    let results = files
        .iter()
        .filter(|it| it.to_string_lossy().ends_with(".xqar"));
    assert_eq!(results.count(), 2, "{files:?}");
    let pages = files.iter().filter(|it| it.starts_with("report-files"));
    assert_eq!(pages.count(), 2, "{files:?}");
}

#[test]
fn summary_of_many_files_names_what_to_fix_first() {
    let cli = Cli::new();
    for number in 0..300 {
        let content = match number % 5 {
            0 => Content::NoHeader(number),
            1 if number < 20 => Content::NoVersion(number),
            _ => Content::Good(number),
        };
        cli.write(&format!("in/{number:03}.xodr"), content.bytes());
    }
    let said = cli.qcbus(&["check", "in"]);
    let (findings, end) = said.stdout.split_once("fix first:\n").unwrap();
    assert_eq!(findings.lines().count(), 64);
    let rows: Vec<&str> = end.lines().collect();
    assert!(rows[0].trim().starts_with("60 in 60 files  error"), "{end}");
    assert!(rows[0].contains("xml.fileheader_is_present"), "{end}");
    assert!(rows[1].trim().starts_with("4 in 4 files  error"), "{end}");
    assert_eq!(
        last_line(&said),
        "64 errors, 0 warnings in 64 of 300 files; 236 accepted, 64 rejected; results in qcbus-out"
    );
    let counted = cli.qcbus(&["check", "in", "-q", "--statistics"]);
    let (_, end) = counted.stdout.split_once("findings by rule:\n").unwrap();
    assert_eq!(end.lines().count(), 2, "{end}");
}

#[test]
fn report_is_made_from_existing_results() {
    let cli = cli();
    cli.qcbus(&["check", "in"]);
    let (bad, good) = ("qcbus-out/in/bad.xodr.xqar", "qcbus-out/in/good.xodr.xqar");
    for format in [
        "text", "concise", "json", "sarif", "junit", "gitlab", "github",
    ] {
        let said = cli.qcbus(&["report", format, bad, good]);
        assert_eq!(said.code, Some(0), "{format}: {}", said.whole(&cli));
        assert!(
            said.stdout.contains("fileheader_is_present"),
            "{format}: {}",
            said.stdout
        );
    }
    let said = cli.qcbus(&["report", "html", bad, good]);
    assert_eq!(
        (said.code, said.stdout.as_str()),
        (Some(0), ""),
        "{}",
        said.whole(&cli)
    );
    assert!(read(&cli, "qcbus-out/in/bad.xodr.html").contains("in/bad.xodr"));
    let said = cli.qcbus(&["report", "sarif", bad, "-o", "one.sarif"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(read(&cli, "one.sarif").contains("2.1.0"));
    cli.write("none.xqar", "<CheckerResults");
    for (file, words) in [
        ("none.xqar", "as a result"),
        ("nowhere.xqar", "nowhere.xqar"),
    ] {
        let said = cli.qcbus(&["report", "json", good, file]);
        assert_eq!(
            (said.code, said.stdout.as_str()),
            (Some(2), ""),
            "{}",
            said.whole(&cli)
        );
        assert!(said.stderr.contains(words), "{}", said.stderr);
    }
}

#[test]
fn rules_are_found_by_partial_names() {
    let cli = Cli::new();
    let family = cli.qcbus(&["rule", "ids"]);
    assert_eq!(family.code, Some(2));
    assert!(
        family
            .stderr
            .contains("check_asam_xodr_ids_only_ref_defined_ids"),
        "{}",
        family.stderr
    );
    let near = cli.qcbus(&["rule", "ids.only_ref_defind_ids"]);
    assert!(
        near.stderr
            .contains("did you mean `ids.only_ref_defined_ids`?"),
        "{}",
        near.stderr
    );
    let word = cli.qcbus(&["rule", "smoothness of elevation"]);
    assert!(word.stderr.contains("smoothness"), "{}", word.stderr);
    let page = cli.qcbus(&["rule", "ids.only_ref_defined_ids"]);
    assert!(
        page.stdout.contains("https://publications.pages.asam.net/"),
        "{}",
        page.stdout
    );
}

/// Runs a check as hooks and editors call it.
fn hook(cli: &Cli, further: &[&str]) -> Said {
    let call = ["check", "--force-exclude", "--output-format", "concise"];
    cli.qcbus(&[&call, further].concat())
}

#[test]
fn excluded_file_named_by_a_hook_is_skipped() {
    let cli = cli();
    cli.write(".qcignore", "vendor/\n");
    cli.write("vendor/bad.xodr", Content::NoHeader(2).bytes());
    let named = cli.qcbus(&["check", "vendor/bad.xodr"]);
    assert_eq!(named.code, Some(1), "without the flag: {named:?}");
    let alone = hook(&cli, &["--", "vendor/bad.xodr"]);
    assert_eq!(alone.code, Some(0), "{alone:?}");
    assert_eq!(alone.stdout, "");
    assert!(alone.stderr.contains("nothing to check"), "{alone:?}");
    let quiet = hook(&cli, &["--quiet", "--", "vendor/bad.xodr"]);
    assert_eq!((quiet.code, &*quiet.stderr), (Some(0), ""), "{quiet:?}");
    let both = hook(&cli, &["-v", "--", "vendor/bad.xodr", "in/bad.xodr"]);
    assert_eq!(both.code, Some(1), "{both:?}");
    assert!(!both.stdout.contains("vendor"), "{both:?}");
    let passed_over = "note: vendor/bad.xodr is excluded by a .qcignore\n";
    assert!(both.stderr.contains(passed_over), "{both:?}");
}

#[test]
fn missing_report_is_explained_when_every_file_is_excluded() {
    let cli = cli();
    cli.write("in/.qcignore", "*\n");
    let said = hook(&cli, &["--output-format", "sarif=all.sarif", "in/bad.xodr"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.stderr.contains("not written: sarif ("), "{said:?}");
    assert!(!cli.path().join("all.sarif").exists());
}
