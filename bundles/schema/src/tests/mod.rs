//! Tests that need the insides of schemas: documents made from tables, and the cost of validation.

mod generate;
mod linear;
mod property;

use std::path::Path;

use qcbus_document::Document;

/// Returns the image of a text.
fn image(name: &str, text: &str) -> Vec<u8> {
    let bytes = text.as_bytes().to_vec();
    qcbus_ingest::prepare_bytes(Path::new(name), bytes, &qcbus_ingest::Limits::default()).build()
}

fn open(image: &[u8]) -> Document<'_> {
    Document::open(image).expect("an image of our own")
}
