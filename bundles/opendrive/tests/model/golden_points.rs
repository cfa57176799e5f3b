//! Compares points with those of ASAM's own bundle, if its cases are available.

use std::path::{Path, PathBuf};

use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_opendrive::RoadMap;

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases")
}

#[test]
fn points_on_roads_agree_with_asam() {
    let Ok(text) = std::fs::read_to_string(cases().join("asam-geometry.json")) else {
        println!("skipped: ../shared/cases/asam-geometry.json is not here");
        return;
    };
    let golden: serde_json::Value = serde_json::from_str(&text).expect("the cases are JSON");
    let points = golden["geometryGoldenPoints"]["cases"]
        .as_array()
        .expect("a list of points");
    assert!(points.len() >= 30, "only {} points", points.len());
    for case in points {
        compare(case);
    }
}

fn compare(case: &serde_json::Value) {
    let number = |name: &str| case[name].as_f64().expect("a number");
    let name = case["file_name"].as_str().expect("a file name");
    let path = cases()
        .join("asam/qc-opendrive/tests/data/utils")
        .join(name);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let image = prepare_bytes(&path, bytes, &Limits::default()).build();
    let map = RoadMap::new(Document::open(&image).expect("the image is valid"));
    let road = map.roads().first().expect("a road");
    let point = road.point(number("s"), number("t"), number("h"));
    let point = point.unwrap_or_else(|| panic!("{case} cannot be evaluated"));
    let got = [point.x, point.y, point.z];
    for (got, want) in got.into_iter().zip(["x", "y", "z"].map(number)) {
        assert!((got - want).abs() < 1e-6, "{case}: {point:?}");
    }
}
