#![no_main]

use std::path::Path;

use qcbus_document::Document;
use qcbus_schema::{Limits, SHIPPED};

// The first byte chooses the schema; the rest is the document.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((choice, text)) = bytes.split_first() else {
        return;
    };
    let limits = qcbus_ingest::Limits::default();
    let image = qcbus_ingest::prepare_bytes(Path::new("a.xodr"), text.to_vec(), &limits).build();
    let shipped = &SHIPPED[usize::from(*choice) % SHIPPED.len()];
    if let (Ok(document), Ok(schema)) = (Document::open(&image), shipped.schema()) {
        let limits = Limits::default();
        let report = schema.validate(&document, limits);
        assert!(report.violations.len() <= limits.total as usize);
    }
});
