//! Checks of the documents: paths, rules, code, the sample farm and the words of the glossary.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::{code, files, root, sources};

#[test]
fn paths_named_in_documents_exist() {
    let root = root();
    let mut wrong = Vec::new();
    for file in files(&root) {
        let markdown = file.extension().is_some_and(|suffix| suffix == "md");
        let inside_tests = file.starts_with(root.join("tests/farm"));
        let map = file.starts_with(root.join("docs")) || file.parent() == Some(&root);
        if !markdown || inside_tests || !map {
            continue;
        }
        let text = std::fs::read_to_string(&file).unwrap();
        for path in named_paths(&text, &root) {
            if !root.join(&path).exists() {
                wrong.push(format!("{} names {path}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Words that once had several meanings, with the only directory that may define each, if any.
const SETTLED_WORDS: &[(&str, &str)] = &[
    ("Place", "bundles/sdk"),
    ("Places", "nowhere"),
    ("Part", "nowhere"),
    ("Lane", "bundles/opendrive"),
    ("Session", "runtime/bus"),
    ("Finding", "bundles/sdk"),
    ("Hold", "nowhere"),
    ("Brought", "nowhere"),
];

/// Maximum number of words that a reader has to learn.
const MOST_ENTRIES: usize = 25;

#[test]
fn glossary_terms_have_one_meaning() {
    let root = root();
    let text = std::fs::read_to_string(root.join("docs/architecture.md")).unwrap();
    let (_, glossary) = text.split_once("## Glossary").unwrap();
    let glossary = glossary.split("\n## ").next().unwrap();
    let defined = defined_types(&root);
    let mut wrong = Vec::new();
    let mut words = 0;
    for row in glossary
        .lines()
        .filter(|line| line.starts_with("| "))
        .skip(1)
    {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        words += 1;
        let Some((name, file)) = cells[2].split_once("` in `") else {
            continue;
        };
        let (name, file) = (name.trim_matches('`'), file.trim_matches('`'));
        let found = defined.get(name).cloned().unwrap_or_default();
        if found != [PathBuf::from(file)] {
            wrong.push(format!(
                "{name} belongs into {file} only, and is in {found:?}"
            ));
        }
    }
    assert!(
        (15..=MOST_ENTRIES).contains(&words),
        "{words} entries, at most {MOST_ENTRIES}: use a standard word instead of a new one"
    );
    for (name, home) in SETTLED_WORDS {
        for file in defined.get(*name).into_iter().flatten() {
            if !file.starts_with(home) {
                wrong.push(format!("{name} in {} means something else", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the structs and enums outside of process tests, each with the files that define it.
fn defined_types(root: &Path) -> BTreeMap<String, Vec<PathBuf>> {
    let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for (file, text) in sources(root) {
        let file = file.strip_prefix(root).unwrap().to_owned();
        if file.starts_with("tests") && !file.starts_with("tests/zoo") {
            continue;
        }
        for (_, line) in code(&text) {
            let line = line.trim_start();
            let line = match line.strip_prefix("pub") {
                Some(rest) => rest.split_once(' ').map_or(rest, |(_, rest)| rest),
                None => line,
            };
            let kinds = ["struct ", "enum "];
            let Some(rest) = kinds.iter().find_map(|kind| line.strip_prefix(kind)) else {
                continue;
            };
            let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_');
            let name = name.map(str::to_owned).next().unwrap_or_default();
            found.entry(name).or_default().push(file.clone());
        }
    }
    found
}

#[test]
fn rules_named_in_documents_exist() {
    let root = root();
    let rules: BTreeSet<String> = ["bundles/xodr", "bundles/xosc"]
        .iter()
        .flat_map(|bundle| files(&root.join(bundle).join("src/rules")))
        .filter(|file| file.extension().is_some_and(|suffix| suffix == "md"))
        .map(|file| file.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    // Every name that begins like the name of a rule counts as a rule.
    let first_words = |name: &str| name.split('_').take(2).collect::<Vec<_>>().join("_");
    let beginnings: BTreeSet<String> = rules.iter().map(|rule| first_words(rule)).collect();
    let mut wrong = Vec::new();
    for file in files(&root.join("docs")) {
        let Ok(text) = std::fs::read_to_string(&file) else {
            continue;
        };
        for word in text.split('`').skip(1).step_by(2) {
            let name = ["_xodr_", "_xosc_"]
                .iter()
                .find_map(|infix| word.strip_prefix("check_")?.split_once(infix))
                .map(|(_, name)| name);
            let named = name.or_else(|| {
                let rule = word.split('_').count() > 2 && beginnings.contains(&first_words(word));
                rule.then_some(word)
            });
            let named = named.map(|name| name.trim_end_matches("_backport"));
            if named.is_some_and(|name| !name.is_empty() && !rules.contains(name)) {
                wrong.push(format!("{} names the rule {word}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn code_in_documents_matches_the_source() {
    let root = root();
    let mut shown = 0;
    for file in files(&root.join("docs")) {
        let Ok(text) = std::fs::read_to_string(&file) else {
            continue;
        };
        for block in text.split("```rust\n// ").skip(1) {
            let (path, rest) = block.split_once('\n').unwrap();
            let code = rest.split("\n```").next().unwrap();
            let whole = std::fs::read_to_string(root.join(path)).unwrap_or_default();
            assert!(
                whole.contains(code),
                "{} shows code that {path} does not contain:\n{code}",
                file.display()
            );
            shown += 1;
        }
    }
    assert!(shown > 0);
}

#[test]
fn farm_files_match_their_table() {
    let farm = root().join("tests/farm");
    let table = std::fs::read_to_string(farm.join("README.md")).unwrap();
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
    let named: BTreeSet<PathBuf> = rows
        .filter_map(|row| Some(PathBuf::from(row.split_once('`')?.0)))
        .collect();
    let there: BTreeSet<PathBuf> = files(&farm)
        .into_iter()
        .map(|file| file.strip_prefix(&farm).unwrap().to_owned())
        .filter(|file| file.extension().is_some_and(|suffix| suffix != "md"))
        // These files are included by other files and are not checked themselves.
        .filter(|file| file.extension().is_some_and(|suffix| suffix != "xml"))
        .collect();
    assert_eq!(named, there);
}

/// Returns the paths in backticks that begin with a directory of the repository.
fn named_paths(text: &str, root: &Path) -> BTreeSet<String> {
    let quoted = text.split('`').skip(1).step_by(2);
    let plain = |word: &&str| {
        word.contains('/')
            && word
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || matches!(c, '/' | '.' | '_' | '-'))
    };
    let ours = |word: &&str| {
        let first = word.split('/').next().unwrap_or_default();
        let made = ["", "..", "target", "qcbus-out"];
        !made.contains(&first) && root.join(first).is_dir()
    };
    quoted
        .filter(plain)
        .filter(ours)
        .map(str::to_owned)
        .collect()
}
