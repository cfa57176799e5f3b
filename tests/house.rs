//! Rules of the repository: allowed dependencies of crates, and forbidden contents.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

#[path = "house/documents.rs"]
mod documents;
#[path = "house/levels.rs"]
mod levels;
#[path = "house/sizes.rs"]
mod sizes;
#[path = "house/targets.rs"]
mod targets;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};

/// Crates that only define data formats. Every crate may use them.
const IDL: &[&str] = &["qcbus-document", "qcbus-formats", "qcbus-messages"];

/// Crates of this workspace that a crate may link, besides [`IDL`]. `None`: any.
const MAY_KNOW: &[(&str, Option<&[&str]>)] = &[
    ("qcbus-document", Some(&[])),
    ("qcbus-formats", Some(&[])),
    ("qcbus-messages", Some(&[])),
    ("qcbus-bus", Some(&["qcbus-disk"])),
    ("qcbus-confine", Some(&[])),
    ("qcbus-disk", Some(&[])),
    ("qcbus-ingest", Some(&["qcbus-disk"])),
    ("qcbus-types", Some(&[])),
    ("qcbus-environment", Some(&["qcbus-ingest"])),
    // Its tests need a configuration, because that demands checkers.
    ("qcbus-state", Some(&["qcbus-types", "qcbus-configuration"])),
    ("qcbus-watch", Some(FILES)),
    ("qcbus-publish", Some(PUBLISH)),
    ("qcbus-configuration", Some(PUBLISH)),
    (
        "qcbus-supervise",
        Some(&[
            "qcbus-types",
            "qcbus-configuration",
            "qcbus-bus",
            "qcbus-confine",
            "qcbus-disk",
        ]),
    ),
    ("qcbus-control", Some(&["qcbus-bus", "qcbus-disk"])),
    ("qcbus-broker", Some(BROKER)),
    ("qcbus-sdk", Some(PROCESS)),
    // This crate has the tests of all bundles: edits, damage and comparison of findings.
    (
        "qcbus-rule-tests",
        Some(&["qcbus-sdk", "qcbus-ingest", "qcbus-fuzzing"]),
    ),
    ("qcbus-opendrive", Some(&[])),
    // A scenario refers to a map, and its values have the types of its schema.
    (
        "qcbus-openscenario",
        Some(&["qcbus-opendrive", "qcbus-schema"]),
    ),
    ("qcbus-schema", Some(&[])),
    // This crate has the common part of all schema rules: for bundles, from their parts.
    ("qcbus-schema-rule", Some(&["qcbus-sdk", "qcbus-schema"])),
    ("qcbus-xodr", Some(BUNDLE)),
    ("qcbus-xosc", Some(BUNDLE)),
    ("qcbus-modular", Some(BUNDLE)),
    // This bundle runs other bundles: it creates their files and confines them.
    (
        "qcbus-asam-adapter",
        Some(&["qcbus-sdk", "qcbus-disk", "qcbus-confine"]),
    ),
    ("qcbus-reporter-sdk", Some(PROCESS)),
    // This crate has sample results for the tests of reporters.
    ("qcbus-reporter-samples", Some(&["qcbus-reporter-sdk"])),
    // This crate draws a road network for a report.
    ("qcbus-plan", Some(&["qcbus-opendrive"])),
    // This crate makes random and damaged images for tests.
    ("qcbus-fuzzing", Some(&["qcbus-document"])),
    ("qcbus", None),
    ("qcbus-zoo", None),
    ("qcbus-benches", None),
];

/// Crates that a part of the broker may link if it looks at files.
const FILES: &[&str] = &[
    "qcbus-types",
    "qcbus-environment",
    "qcbus-disk",
    "qcbus-ingest",
];

/// Crates that a part of the broker may link if it reads or writes for others.
const PUBLISH: &[&str] = &[
    "qcbus-types",
    "qcbus-environment",
    "qcbus-watch",
    "qcbus-bus",
    "qcbus-disk",
    "qcbus-ingest",
];

/// Crates that the broker joins.
const BROKER: &[&str] = &[
    "qcbus-types",
    "qcbus-environment",
    "qcbus-state",
    "qcbus-watch",
    "qcbus-publish",
    "qcbus-configuration",
    "qcbus-supervise",
    "qcbus-control",
    "qcbus-bus",
    "qcbus-disk",
    "qcbus-ingest",
];

/// Parts of every kind of process.
const PROCESS: &[&str] = &["qcbus-bus", "qcbus-confine", "qcbus-disk", "qcbus-ingest"];

/// Crates that a bundle may link: its sdk, the models and the schema rule.
const BUNDLE: &[&str] = &[
    "qcbus-sdk",
    "qcbus-opendrive",
    "qcbus-openscenario",
    "qcbus-schema",
    "qcbus-schema-rule",
];

/// Crates that every test may link: they read, edit and damage files, and have sample results.
const FOR_TESTS: &[&str] = &[
    "qcbus-ingest",
    "qcbus-rule-tests",
    "qcbus-fuzzing",
    "qcbus-reporter-samples",
];

/// Prefix of the crate name of a reporter. A further reporter needs no row in [`MAY_KNOW`].
const A_REPORTER: &str = "qcbus-report-";

/// Crates that a reporter may link: its sdk, the models, and the drawing of road networks.
const REPORTER: &[&str] = &[
    "qcbus-reporter-sdk",
    "qcbus-plan",
    "qcbus-opendrive",
    "qcbus-openscenario",
];

/// Allowed dependencies among the crates of [`IDL`]: the lowest crate has none.
const INSIDE_IDL: &[(&str, &[&str])] = &[
    ("qcbus-document", &[]),
    ("qcbus-formats", &[]),
    ("qcbus-messages", &["qcbus-document", "qcbus-formats"]),
];

/// Models that read images and nothing else. Their tests may also use ingest, because it writes the
/// images.
const ONLY_DOCUMENT: &[&str] = &["qcbus-opendrive", "qcbus-schema"];

/// Foreign crates that only a few crates may name, so that they can be replaced. The benches
/// compare with them.
const SANDBOXED: &[(&str, &[&str])] = &[
    ("iceoryx2", &["qcbus-bus", "qcbus-benches"]),
    ("iceoryx2-cal", &["qcbus-bus"]),
    ("iceoryx2-bb-elementary-traits", &["qcbus-bus"]),
    ("iceoryx2-bb-lock-free", &["qcbus-bus"]),
    ("bincode", &["qcbus-messages", "qcbus-benches"]),
    (
        "quick-xml",
        &["qcbus-ingest", "qcbus-formats", "qcbus-benches"],
    ),
];

/// Maximum number of lines of a source file, so that it stays readable.
const MAX_LINES: usize = 800;

fn metadata() -> Metadata {
    // Without dependencies nothing is resolved and nothing is downloaded.
    MetadataCommand::new().no_deps().exec().unwrap()
}

fn root() -> PathBuf {
    metadata().workspace_root.into_std_path_buf()
}

fn linked<'p>(package: &'p Package, kinds: &[DependencyKind]) -> BTreeSet<&'p str> {
    let dependencies = package.dependencies.iter();
    let of_kind = dependencies.filter(|dependency| kinds.contains(&dependency.kind));
    of_kind.map(|dependency| dependency.name.as_str()).collect()
}

fn allowed(name: &str) -> Option<BTreeSet<&'static str>> {
    let inside = INSIDE_IDL.iter().find(|(idl, _)| *idl == name);
    if let Some((_, others)) = inside {
        return Some(others.iter().copied().collect());
    }
    if ONLY_DOCUMENT.contains(&name) {
        return Some(BTreeSet::from(["qcbus-document"]));
    }
    if name.starts_with(A_REPORTER) {
        return Some(REPORTER.iter().chain(IDL).copied().collect());
    }
    let (_, others) = MAY_KNOW
        .iter()
        .find(|(other, _)| *other == name)
        .unwrap_or_else(|| {
            panic!("{name} is new: add its allowed dependencies to MAY_KNOW, with the reason")
        });
    let others = (*others)?;
    Some(others.iter().chain(IDL).copied().collect())
}

#[test]
fn crates_link_only_allowed_crates() {
    let metadata = metadata();
    let ours: BTreeSet<&str> = metadata.packages.iter().map(|p| p.name.as_str()).collect();
    let mut wrong = Vec::new();
    for package in &metadata.packages {
        let Some(allowed) = allowed(&package.name) else {
            continue;
        };
        let build = [DependencyKind::Normal, DependencyKind::Build];
        for other in linked(package, &build).intersection(&ours) {
            if !allowed.contains(other) {
                wrong.push(format!("{} links {other}", package.name));
            }
        }
        for other in linked(package, &[DependencyKind::Development]).intersection(&ours) {
            if !IDL.contains(other) && !FOR_TESTS.contains(other) && !allowed.contains(other) {
                wrong.push(format!("the tests of {} link {other}", package.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_crate_is_in_the_table() {
    let metadata = metadata();
    let is_reporter = |name: &&str| name.starts_with(A_REPORTER);
    let names = metadata.packages.iter().map(|p| p.name.as_str());
    let ours: BTreeSet<&str> = names.filter(|name| !is_reporter(name)).collect();
    let table: BTreeSet<&str> = MAY_KNOW.iter().map(|(name, _)| *name).collect();
    assert_eq!(ours, table);
}

#[test]
fn sandboxed_crates_are_used_only_where_allowed() {
    let metadata = metadata();
    let mut wrong = Vec::new();
    for (sandboxed, friends) in SANDBOXED {
        let path = format!("{}::", sandboxed.replace('-', "_"));
        for package in &metadata.packages {
            if friends.contains(&package.name.as_str()) {
                continue;
            }
            if package.dependencies.iter().any(|d| d.name == *sandboxed) {
                wrong.push(format!("{} depends on {sandboxed}", package.name));
            }
            let directory = package.manifest_path.parent().unwrap();
            for (file, text) in sources(directory.as_std_path()) {
                if code(&text).any(|(_, line)| line.contains(&path)) {
                    wrong.push(format!("{} names {path}", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_codec_names_its_encoding() {
    let named = sources(&root().join("idl/messages"))
        .into_iter()
        .filter(|(_, text)| code(text).any(|(_, line)| line.contains("bincode::")))
        .map(|(file, _)| file.file_name().unwrap().to_owned())
        .collect::<Vec<_>>();
    assert_eq!(named, ["codec.rs"]);
}

#[test]
fn every_crate_uses_the_workspace_lints() {
    for package in metadata().packages {
        let manifest = std::fs::read_to_string(&package.manifest_path).unwrap();
        assert!(
            manifest.contains("[lints]\nworkspace = true"),
            "{} has no `[lints] workspace = true`",
            package.manifest_path
        );
    }
}

#[test]
fn no_file_exceeds_the_line_limit() {
    let long: BTreeMap<PathBuf, usize> = sources(&root())
        .into_iter()
        .map(|(file, text)| (file, text.lines().count()))
        .filter(|(_, lines)| *lines > MAX_LINES)
        .collect();
    assert!(long.is_empty(), "more than {MAX_LINES} lines: {long:#?}");
}

#[test]
fn no_test_is_ignored() {
    let off = ["#[ignore", ", ignore"].map(str::to_owned);
    let mut wrong = Vec::new();
    for (file, text) in sources(&root()) {
        for (number, line) in code(&text) {
            let line = line.trim_start();
            let attribute = line.starts_with("#[");
            if attribute && off.iter().any(|word| line.contains(word.as_str())) {
                wrong.push(format!("{}:{number}: {line}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_file_contains_a_local_path() {
    // The paths are split, so that this file does not match itself.
    let homes = [["/wo", "rk/"], ["/ro", "ot/"]].map(|halves| halves.concat());
    let mut wrong = Vec::new();
    for file in files(&root()) {
        let Ok(text) = std::fs::read_to_string(&file) else {
            continue;
        };
        for (number, line) in text.lines().enumerate() {
            let named = |home: &String| {
                let mut found = line.match_indices(home.as_str());
                found.any(|(at, _)| starts_a_path(&line[..at]))
            };
            if homes.iter().any(named) {
                wrong.push(format!("{}:{}: {line}", file.display(), number + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Checks whether a path may begin after `before`. It must not be in the middle of another one.
fn starts_a_path(before: &str) -> bool {
    !before.ends_with(|c: char| c.is_alphanumeric() || matches!(c, '.' | '_' | '-' | '}'))
}

/// Returns the lines of code with their numbers. Comments may name anything.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate();
    numbered
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
        .map(|(number, line)| (number + 1, line))
}

fn sources(directory: &Path) -> Vec<(PathBuf, String)> {
    let files = files(directory).into_iter();
    let rust = files.filter(|file| file.extension().is_some_and(|suffix| suffix == "rs"));
    rust.map(|file| {
        let text = std::fs::read_to_string(&file).unwrap();
        (file, text)
    })
    .collect()
}

/// Returns all files below in order, without build output and git's own files: a directory, or a
/// file in a further work tree.
fn files(directory: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![directory.to_owned()];
    while let Some(directory) = open.pop() {
        for entry in std::fs::read_dir(&directory).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().to_string_lossy().into_owned();
            let kind = entry.file_type().unwrap();
            let built = name.starts_with("target") || name == "qcbus-out" || name == ".git";
            if kind.is_dir() && !built {
                open.push(entry.path());
            } else if kind.is_file() && name != ".git" {
                found.push(entry.path());
            }
        }
    }
    found.sort();
    found
}
