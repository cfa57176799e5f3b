//! Scenarios made from text, for tests.

#![expect(clippy::expect_used, reason = "test helpers may panic")]

use std::path::Path;

use qcbus_document::{Document, FileKind};
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_openscenario::{Inputs, LinkedCatalog, LinkedMap, Scenario};

/// Returns the image of a file.
fn image(name: &str, text: &str) -> Vec<u8> {
    prepare_bytes(
        Path::new(name),
        text.as_bytes().to_vec(),
        &Limits::default(),
    )
    .build()
}

/// Runs `test` on the scenario with this `body` in a file of version 1.3, with these catalogs. Each
/// text is the content of a `Catalog` with the name `c` plus its number. Its directory is the
/// catalog location with the same index.
pub fn with_catalogs<T>(body: &str, catalogs: &[&str], test: impl FnOnce(&Scenario<'_>) -> T) -> T {
    let header = "<FileHeader revMajor=\"1\" revMinor=\"3\" date=\"2026-01-01T00:00:00\" description=\"\" author=\"\"/>";
    let root = image(
        "root.xosc",
        &format!("<OpenSCENARIO>{header}{body}</OpenSCENARIO>"),
    );
    let images: Vec<Vec<u8>> = catalogs
        .iter()
        .enumerate()
        .map(|(number, entries)| {
            let text = format!("<OpenSCENARIO>{header}<Catalog name=\"c{number}\">{entries}</Catalog></OpenSCENARIO>");
            image(&format!("c{number}.xosc"), &text)
        })
        .collect();
    let document = Document::open(&root).expect("the image is valid");
    let directories: Vec<u32> = document
        .elements("Directory")
        .map(|node| node.offset())
        .collect();
    let linked = images
        .iter()
        .enumerate()
        .map(|(number, image)| LinkedCatalog {
            document: Document::open(image).expect("the image is valid"),
            referred_at: directories.get(number).copied().unwrap_or(0),
        });
    let inputs = Inputs {
        document,
        kind: FileKind::Xosc,
        version: Some((1, 3)),
        map: LinkedMap::Unnamed,
        catalogs: linked.collect(),
        incomplete: Vec::new(),
    };
    test(&Scenario::new(&inputs).expect("the document has a root"))
}

/// Runs `test` on the scenario with this `body` in a file of version 1.3.
pub fn with_scenario<T>(body: &str, test: impl FnOnce(&Scenario<'_>) -> T) -> T {
    with_catalogs(body, &[], test)
}
