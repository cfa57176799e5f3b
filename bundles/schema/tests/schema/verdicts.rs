//! Compares verdicts with those of lxml and xmlschema on mutants of documents of this project.
//! `tests/schema/differential.py` recorded them: each line names a document, a splice, and whether
//! the other validators accept the result.

use std::collections::HashMap;
use std::path::Path;

use crate::support::{image, open, table};
use qcbus_schema::Limits;

#[test]
fn verdicts_match_recorded_reference_verdicts() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let recorded = std::fs::read_to_string(folder.join("verdicts.jsonl"))
        .expect("the recorded verdicts are readable");
    let mut documents: HashMap<String, String> = HashMap::new();
    let (mut valid, mut invalid) = (0, 0);
    for line in recorded.lines().skip(1) {
        let verdict: serde_json::Value =
            serde_json::from_str(line).expect("the line is valid JSON");
        let name = verdict["document"].as_str().expect("a document");
        let base = documents.entry(name.to_owned()).or_insert_with(|| {
            std::fs::read_to_string(folder.join("documents").join(name))
                .expect("the document is readable")
        });
        let text = spliced(base, &verdict);
        let image = image(name, &text);
        let document = open(&image);
        let (of_table, _) = name.rsplit_once('-').expect("a table's name");
        let report = table(of_table).validate(&document, Limits::default());
        let expected = verdict["valid"].as_bool().expect("a verdict");
        assert_eq!(
            report.is_valid(),
            expected,
            "{line}: {:?}",
            report.violations.first().map(|one| &one.text)
        );
        if expected { valid += 1 } else { invalid += 1 }
    }
    assert!(
        valid > 100 && invalid > 300,
        "{valid} valid, {invalid} invalid"
    );
}

/// Offsets count characters, as in Python.
fn spliced(base: &str, verdict: &serde_json::Value) -> String {
    let number =
        |name: &str| usize::try_from(verdict[name].as_u64().expect("a number")).expect("small");
    let (at, removed) = (number("at"), number("remove"));
    let head = base.chars().take(at);
    let tail = base.chars().skip(at + removed);
    head.chain(verdict["insert"].as_str().expect("a text").chars())
        .chain(tail)
        .collect()
}

#[test]
fn own_test_documents_are_valid() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/documents");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("documents") {
        let path = entry.expect("a file").path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .expect("a name")
            .to_owned();
        let text = std::fs::read_to_string(&path).expect("text");
        let image = image(&name, &text);
        let (of_table, _) = name.rsplit_once('-').expect("a table's name");
        let report = table(of_table).validate(&open(&image), Limits::default());
        assert!(
            report.is_valid(),
            "{name}: {:?}",
            report.violations.first().map(|one| &one.text)
        );
        count += 1;
    }
    assert!(count >= 24, "{count}");
}
