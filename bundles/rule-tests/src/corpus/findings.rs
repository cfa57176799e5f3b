//! Prints all findings of a bundle in files, one line each, for manual review.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use qcbus_document::FileKind;
use qcbus_formats::xqar::{Issue, Level, Location};

use qcbus_sdk::run::examine;
use qcbus_sdk::{BACKPORT_SUFFIX, Bundle, Loaded, Plan};

/// Prints every finding in the given files and in the files below given directories: file, checker,
/// level, row, text. With `--counts` it prints a table with the number of findings and files of
/// each rule. `[--counts] [--checker PART] PATH…`
///
/// # Errors
/// Returns an error for a file that cannot be read.
#[expect(clippy::print_stdout, reason = "a tool for the terminal")]
pub fn print_findings(
    bundle: &'static Bundle,
    arguments: impl Iterator<Item = String>,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = arguments.peekable();
    let counted = arguments
        .next_if(|argument| argument == "--counts")
        .is_some();
    let part = match arguments.next_if(|argument| argument == "--checker") {
        Some(_) => arguments.next().unwrap_or_default(),
        None => String::new(),
    };
    let plan = Plan::new(bundle, |checker| checker.id.contains(&part), |_, _| None);
    let mut files = Vec::new();
    for argument in arguments {
        gather(bundle, Path::new(&argument), &mut files);
    }
    let mut counts = Counts::default();
    for path in &files {
        let loaded = Loaded::from_path(path, path.parent().unwrap_or(path))?;
        for checker in examine(&plan, &loaded)?.checkers {
            for issue in &checker.issues {
                if counted {
                    counts.add(path, &checker.id, issue);
                } else {
                    println!("{}", line(path, &checker.id, issue));
                }
            }
        }
    }
    if counted {
        print!("{}", counts.table(files.len()));
    }
    Ok(())
}

fn line(path: &Path, checker: &str, issue: &Issue) -> String {
    let places = issue.locations.first().map(|first| first.places.as_slice());
    let row = places
        .unwrap_or_default()
        .iter()
        .find_map(|place| match place {
            Location::File { row, .. } => Some(row.to_string()),
            _ => None,
        });
    format!(
        "{}\t{checker}\t{:?}\t{}\t{}",
        path.display(),
        issue.level,
        row.unwrap_or_default(),
        issue.description,
    )
}

/// Findings and files of each level, by rule. A checker for older versions counts with its rule.
#[derive(Default)]
struct Counts(BTreeMap<String, ByLevel>);

type ByLevel = BTreeMap<Level, (usize, BTreeSet<PathBuf>)>;

impl Counts {
    fn add(&mut self, path: &Path, checker: &str, issue: &Issue) {
        let rule = checker.strip_suffix(BACKPORT_SUFFIX).unwrap_or(checker);
        let rule = rule.split_once("_xodr_").or(rule.split_once("_xosc_"));
        let rule = rule.map_or(checker, |(_, name)| name).to_owned();
        let (findings, files) = self
            .0
            .entry(rule)
            .or_default()
            .entry(issue.level)
            .or_default();
        *findings += 1;
        files.insert(path.to_owned());
    }

    /// Formats the table, sorted by number of files in descending order.
    fn table(&self, files: usize) -> String {
        let mut text = format!(
            "{files} files\n\n| rule | errors | files | warnings | files | information | files |\n\
             |---|--:|--:|--:|--:|--:|--:|\n"
        );
        let levels = [Level::Error, Level::Warning, Level::Information];
        let files = |rule: &ByLevel| {
            levels.map(|level| rule.get(&level).map_or(0, |(_, files)| files.len()))
        };
        let mut rules: Vec<_> = self.0.iter().collect();
        rules.sort_by_key(|(_, rule)| std::cmp::Reverse(files(rule)));
        for (name, rule) in rules {
            let cells = levels.map(|level| match rule.get(&level) {
                Some((findings, files)) => format!(" {findings} | {} |", files.len()),
                None => "  |  |".to_owned(),
            });
            let cells = cells.concat();
            _ = writeln!(text, "| `{name}` |{cells}");
        }
        text
    }
}

/// Collects the files at and below a path that the bundle checks, sorted by name.
fn gather(bundle: &Bundle, path: &Path, files: &mut Vec<PathBuf>) {
    if !path.is_dir() {
        files.push(path.to_owned());
        return;
    }
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    let mut entries: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    entries.sort();
    for entry in entries {
        let wanted = FileKind::of_path(&entry).is_some_and(|kind| bundle.kinds.contains(&kind));
        if entry.is_dir() || wanted {
            gather(bundle, &entry, files);
        }
    }
}
