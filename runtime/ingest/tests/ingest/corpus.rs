//! Files of other projects, if they are available: each builds, and faults are at their places.

use std::fs;
use std::path::{Path, PathBuf};

use qcbus_document::{Document, FileKind};
use qcbus_ingest::{Limits, prepare};

fn cases(below: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/cases")
        .join(below);
    let mut folders = vec![root];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if FileKind::of_path(&path).is_some() {
                files.push(path);
            }
        }
    }
    if files.is_empty() {
        println!("skipped: there is no ../shared/cases/{below}");
    }
    files.sort();
    files
}

/// Counts start tags by hand: `<` and a letter, outside of comments and CDATA sections.
fn count_tags(text: &str) -> usize {
    let (mut count, mut rest) = (0, text);
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let end = if rest.starts_with("<!--") {
            "-->"
        } else if rest.starts_with("<![CDATA[") {
            "]]>"
        } else {
            count += usize::from(rest[1..].starts_with(|c: char| c.is_alphabetic()));
            "<"
        };
        rest = rest[1..].find(end).map_or("", |skip| &rest[1 + skip..]);
    }
    count
}

#[test]
fn real_files_are_well_formed_and_complete() {
    for path in cases("real") {
        let prepared = prepare(&path, path.parent().unwrap(), &Limits::default()).unwrap();
        let image = prepared.build();
        assert!(image.len() <= prepared.upper_bound());
        let document = Document::open(&image).unwrap();
        document
            .validate()
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let faults: Vec<String> = document
            .faults()
            .filter(|fault| fault.code.makes_partial())
            .map(|fault| {
                format!(
                    "{} {} {}",
                    path.display(),
                    document.position(fault.offset),
                    fault.text
                )
            })
            .collect();
        assert_eq!(faults, Vec::<String>::new());
        if let Ok(text) = fs::read_to_string(&path) {
            let root = document.root().unwrap();
            assert_eq!(
                1 + root.descendants().count(),
                count_tags(&text),
                "{}",
                path.display()
            );
        }
    }
}

#[test]
fn only_malformed_asam_cases_have_faults() {
    for path in cases("asam") {
        let image = prepare(&path, path.parent().unwrap(), &Limits::default())
            .unwrap()
            .build();
        let document = Document::open(&image).unwrap();
        document.validate().unwrap();
        let text = path.to_string_lossy();
        let malformed = text.contains("valid_xml_document") && text.contains("negative");
        let faults: Vec<&str> = document.faults().map(|fault| fault.text).collect();
        assert_eq!(!document.is_well_formed(), malformed, "{text}: {faults:?}");
    }
}
