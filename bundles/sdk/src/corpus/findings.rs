//! Everything that a bundle finds in files, one line each, for those who judge whether it is right.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use qcbus_document::FileKind;
use qcbus_formats::xqar::{Issue, Level, Location};

use crate::run::examine;
use crate::{BACKPORT_SUFFIX, Bundle, Loaded, Plan};

/// Prints every finding on the files that are named, and on those below directories: file, checker,
/// level, row, text; or with `--counts` a table of how many of them each rule has on how many files.
/// `[--counts] [--checker PART] PATH…`
///
/// # Errors
/// What could not be read.
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

/// By rule (a checker for older versions is counted with its rule): of each level the findings and the files.
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

    /// The rule with the most files first.
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

/// The files at and below a path that the bundle looks at, by name.
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
