//! Bodies of the fuzz targets, run as seeded tests on stable.

use std::path::Path;

use qcbus_document::Document;

use crate::modular::SearchPath;
use crate::{Limits, prepare_bytes, references};

/// Whatever the bytes are and whatever the name promises: there is an image, it is valid, its
/// places can be found, and it does not outgrow its bound.
///
/// # Panics
/// When one of these does not hold.
#[expect(clippy::panic, reason = "a fuzz body reports by panicking")]
pub fn ingest(bytes: &[u8]) {
    let limits = Limits {
        max_file: 1 << 20,
        max_unpacked: 1 << 22,
        ..Limits::default()
    };
    for name in ["fuzz.xodr", "fuzz.xodr.gz", "fuzz.xosc", "fuzz.mosc"] {
        let prepared = prepare_bytes(Path::new(name), bytes.to_vec(), &limits);
        let image = prepared.build();
        let document = match Document::open(&image) {
            Ok(document) => document,
            Err(error) => panic!("{name}: {error}"),
        };
        if let Err(error) = document.validate() {
            panic!("{name}: {error}");
        }
        for fault in document.faults() {
            assert!(document.position(fault.offset).row > 0);
        }
        if document.root().is_none() {
            assert!(
                document.faults().next().is_some(),
                "{name}: no root and no fault"
            );
        }
        references(&document, &SearchPath::default());
    }
}
