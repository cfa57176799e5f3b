//! The sample farm: `qcbus check` reports, shows and writes what its README promises.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::support::asam;
use crate::support::cli::{Cli, checkers, files_below, issues, places, read_result, sample_farm};
use qcbus_formats::xqar::{Level, Status};

/// A row of the README's table of faulty files.
#[derive(Debug)]
struct Promise {
    file: String,
    /// End of a checker id or of a rule UID.
    rule: String,
    /// Rows, with columns if the table contains them.
    places: Vec<(u64, Option<u64>)>,
}

/// Returns the cells of the table below a heading.
fn table(heading: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(sample_farm().join("README.md")).unwrap();
    let section = text
        .split("\n## ")
        .find(|it| it.starts_with(heading))
        .unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    rows.map(|row| {
        row.trim_matches('|')
            .split('|')
            .map(|cell| cell.trim().to_owned())
            .collect()
    })
    .collect()
}

/// Returns the first text in backticks.
fn quoted(cell: &str) -> String {
    cell.split('`')
        .nth(1)
        .unwrap_or_else(|| panic!("expected quoted text in {cell}"))
        .to_owned()
}

fn promises() -> Vec<Promise> {
    let row = |row: Vec<String>| Promise {
        file: quoted(&row[0]),
        rule: quoted(&row[2]).trim_start_matches('…').to_owned(),
        places: numbers(&row[3]),
    };
    table("Rejected").into_iter().map(row).collect()
}

fn numbers(cell: &str) -> Vec<(u64, Option<u64>)> {
    let words = cell.split(|c: char| !c.is_ascii_digit() && c != ':');
    let words = words.filter(|word| !word.is_empty());
    words
        .map(|word| match word.split_once(':') {
            Some((row, column)) => (row.parse().unwrap(), Some(column.parse().unwrap())),
            None => (word.parse().unwrap(), None),
        })
        .collect()
}

/// Checks whether a printed line is an error of that file.
fn has_error(printed: &str, file: &str) -> bool {
    let place = format!("{file}:");
    let mut lines = printed.lines();
    lines.any(|line| line.starts_with(&place) && line.contains(": error: "))
}

fn checkable() -> Vec<PathBuf> {
    let mut files = files_below(&sample_farm());
    files.retain(|file| qcbus_document::FileKind::of_path(file).is_some());
    files
}

#[test]
fn every_expected_issue_is_found_at_its_place() {
    let cli = Cli::new();
    let said = cli.check_in(&sample_farm(), &["."], "out");
    assert_eq!(said.code, Some(1), "{}", said.whole(&cli));
    let promises = promises();
    assert_eq!(promises.len(), 24, "the whole table is read");
    for Promise {
        file,
        rule,
        places: promised,
    } in promises
    {
        let results = cli.result(&format!("out/{file}.xqar"));
        let found: Vec<(u64, u64)> = issues(&results)
            .filter(|(checker, issue)| {
                checker.id.ends_with(&rule) || issue.rule_uid.ends_with(&rule)
            })
            .flat_map(|(_, issue)| places(issue))
            .collect();
        assert!(!promised.is_empty());
        for (row, column) in promised {
            let hit = found
                .iter()
                .any(|it| it.0 == row && column.is_none_or(|column| it.1 == column));
            assert!(
                hit,
                "{file}: {rule} at {row}:{column:?}, found at {found:?}"
            );
        }
        assert!(has_error(&said.stdout, &file), "{}", said.stdout);
    }
}

#[test]
fn good_files_are_accepted_without_findings() {
    let cli = Cli::new();
    let said = cli.check_in(&sample_farm(), &["."], "out");
    let good = table("Accepted");
    let faulty: BTreeSet<String> = promises().into_iter().map(|it| it.file).collect();
    assert_eq!(
        good.len() + faulty.len(),
        checkable().len(),
        "every file is in the README"
    );
    for row in good {
        let file = quoted(&row[0]);
        assert!(!has_error(&said.stdout, &file), "{}", said.stdout);
        let results = cli.result(&format!("out/{file}.xqar"));
        let is_warning = row[1].contains("a warning");
        let worst = if is_warning {
            Level::Error
        } else {
            Level::Warning
        };
        let blame: Vec<_> = issues(&results)
            .filter(|(_, it)| it.level <= worst)
            .collect();
        assert!(blame.is_empty(), "{file}: {blame:#?}");
    }
}

#[test]
fn every_issue_is_printed_with_row_and_column() {
    let cli = Cli::new();
    let said = cli.check_in(&sample_farm(), &["."], "out");
    let mut count = 0;
    for file in checkable() {
        let file = file.to_string_lossy();
        let results = cli.result(&format!("out/{file}.xqar"));
        for (_, issue) in issues(&results) {
            let (row, column) = places(issue)[0];
            let place = format!("{file}:{row}:{column}: {}: ", issue.level.as_str());
            assert!(said.stdout.contains(&place), "{place}{}", said.stdout);
            assert!(
                said.stdout.contains(&issue.description),
                "{}",
                issue.description
            );
            count += 1;
        }
    }
    assert!(count >= 13, "too few issues: {count}");
}

#[test]
fn only_valid_xml_is_checked_for_its_meaning() {
    let cli = Cli::new();
    let said = cli.check_in(&sample_farm(), &["faulty/not_well_formed.xodr"], "out");
    assert_eq!(said.code, Some(1));
    let results = cli.result("out/faulty/not_well_formed.xodr.xqar");
    for checker in checkers(&results) {
        let expected = match &*checker.id {
            "check_asam_xodr_xml_valid_xml_document" => Status::Completed,
            _ => Status::Skipped,
        };
        assert_eq!(
            checker.status,
            Some(expected),
            "{}: {}",
            checker.id,
            checker.summary
        );
    }
}

#[test]
fn results_are_written_to_predictable_places() {
    let cli = Cli::new();
    let farm = sample_farm();
    cli.check_in(&farm, &["."], "tree");
    let expected: Vec<PathBuf> = checkable()
        .iter()
        .map(|file| format!("{}.xqar", file.display()).into())
        .collect();
    assert_eq!(
        files_below(&cli.path().join("tree")),
        expected,
        "exactly one result for each file"
    );

    // The result of a file elsewhere is placed by the file's path from the root.
    let ring = farm.join("maps/ring.xodr");
    cli.qcbus(&["check", &ring.to_string_lossy()]);
    let from_root = ring.strip_prefix("/").unwrap().to_string_lossy();
    let result = format!("qcbus-out/{from_root}.xqar");
    assert!(cli.path().join(&result).exists(), "{result}");

    // The place does not depend on other files in this run or in another.
    for file in ["a/x/m.xodr", "a/y/m.xodr", "b/m.xodr"] {
        cli.write(file, "<OpenDRIVE/>");
    }
    for paths in [
        &["a/x/m.xodr", "a/y/m.xodr"][..],
        &["b/m.xodr"],
        &["a/x"],
        &["a"],
        &["b"],
    ] {
        cli.qcbus(&[&["check", "--out", "all"], paths].concat());
    }
    let expected = ["a/x/m.xodr.xqar", "a/y/m.xodr.xqar", "b/m.xodr.xqar"].map(PathBuf::from);
    assert_eq!(files_below(&cli.path().join("all")), expected);
}

#[test]
fn two_runs_write_the_same_bytes() {
    let cli = Cli::new();
    let farm = sample_farm();
    let one = cli.check_in(&farm, &["."], "one");
    let two = cli.check_in(&farm, &["."], "two");
    // Only the place of the results differs, which the last line names.
    assert_eq!(one.stdout.replace("/one\n", "/two\n"), two.stdout);
    for file in files_below(&cli.path().join("one")) {
        let read = |run: &str| std::fs::read_to_string(cli.path().join(run).join(&file)).unwrap();
        let text = read("one");
        assert!(text == read("two"), "{} differs", file.display());
        assert!(
            !text.contains(&*cli.path().to_string_lossy()),
            "the output must not name the working directory"
        );
    }
}

#[test]
fn every_result_conforms_to_the_asam_format() {
    let cli = Cli::new();
    cli.check_in(&sample_farm(), &["."], "out");
    let files = files_below(&cli.path().join("out"));
    assert_eq!(files.len(), checkable().len());
    for file in files {
        let path = cli.path().join("out").join(&file);
        let complaints = asam::complaints(&std::fs::read_to_string(&path).unwrap());
        assert!(complaints.is_empty(), "{}: {complaints:#?}", file.display());
        assert!(!read_result(&path).bundles.is_empty());
    }
}

#[test]
fn output_for_the_whole_farm_fits_on_one_screen() {
    let cli = Cli::new();
    let said = cli.check_in(&sample_farm(), &["."], "out");
    assert_eq!((said.code, said.stderr.as_str()), (Some(1), ""));
    let place = cli.path().canonicalize().unwrap();
    let text = said.stdout.replace(&*place.to_string_lossy(), "DIR");
    let text = text.replace(&*sample_farm().to_string_lossy(), "FARM");
    assert!(text.lines().count() <= 60, "{text}");
    insta::assert_snapshot!(text);
}
