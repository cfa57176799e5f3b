#![no_main]

use std::path::Path;

use qcbus_document::Document;
use qcbus_schema::{Limits, Schema, compile};

// The input is an XSD and, after a NUL, a document for it. Tables that are written and read again
// must give the same verdict.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let image = |name: &str, bytes: &[u8]| {
        let limits = qcbus_ingest::Limits::default();
        qcbus_ingest::prepare_bytes(Path::new(name), bytes.to_vec(), &limits).build()
    };
    let xsd = image("a.xsd", parts.next().unwrap_or_default());
    let text = image("a.xodr", parts.next().unwrap_or_default());
    let (Ok(xsd), Ok(document)) = (Document::open(&xsd), Document::open(&text)) else {
        return;
    };
    let Ok(schema) = compile("fuzz", &[xsd]) else {
        return;
    };
    let again = Schema::from_notation(&schema.to_notation()).expect("the notation of a compiled schema is \
        readable");
    let found = schema.validate(&document, Limits::default());
    assert_eq!(found.total(), again.validate(&document, Limits::default()).total());
});
