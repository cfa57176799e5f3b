//! Helpers of the tests: documents from text, tables by name.

#![expect(
    clippy::expect_used,
    reason = "a test panics if its data is not as expected"
)]

use std::path::Path;

use qcbus_document::{Document, FileKind};
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_schema::{SHIPPED, Schema, Shipped};

/// Returns the image of a text.
pub fn image(name: &str, text: &str) -> Vec<u8> {
    prepare_bytes(
        Path::new(name),
        text.as_bytes().to_vec(),
        &Limits::default(),
    )
    .build()
}

/// Opens the document of an image.
pub fn open(image: &[u8]) -> Document<'_> {
    Document::open(image).expect("the image is valid")
}

/// Returns the name of a shipped table's file.
pub fn name_of(shipped: &Shipped) -> String {
    let kind = if shipped.kind == FileKind::Xodr {
        "xodr"
    } else {
        "xosc"
    };
    format!("{kind}-{}", shipped.version)
}

/// Returns a shipped table by name, e.g. `xodr-1.7`.
pub fn table(name: &str) -> &'static Schema {
    let found = SHIPPED.iter().find(|one| name_of(one) == name);
    found
        .expect("the table is a shipped table")
        .schema()
        .expect("the table is valid")
}

/// Compiles the text of one XSD.
pub fn compiled(text: &str) -> Result<Schema, String> {
    let image = image("test.xsd", text);
    qcbus_schema::compile("Test", &[open(&image)]).map_err(|error| error.to_string())
}

/// Returns the codes and texts of all violations of a document.
pub fn violations(schema: &Schema, name: &str, text: &str) -> Vec<(&'static str, String)> {
    let image = image(name, text);
    let report = schema.validate(&open(&image), qcbus_schema::Limits::default());
    report
        .violations
        .iter()
        .map(|one| (one.code.as_str(), one.text.clone()))
        .collect()
}
