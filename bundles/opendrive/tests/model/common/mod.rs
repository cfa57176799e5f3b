//! Documents made from text, for tests.

#![expect(clippy::expect_used, reason = "test helpers may panic")]

use std::path::Path;

use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_opendrive::RoadMap;

/// Returns the image of a file with this text.
pub fn image(xml: &str) -> Vec<u8> {
    prepare_bytes(
        Path::new("map.xodr"),
        xml.as_bytes().to_vec(),
        &Limits::default(),
    )
    .build()
}

/// Runs `test` on the map that `roads` form within a complete file.
pub fn with_map<T>(roads: &str, test: impl FnOnce(&RoadMap<'_>) -> T) -> T {
    let xml = format!("<OpenDRIVE><header revMajor=\"1\" revMinor=\"9\"/>{roads}</OpenDRIVE>");
    let image = image(&xml);
    let document = Document::open(&image).expect("the image is valid");
    test(&RoadMap::new(document))
}
