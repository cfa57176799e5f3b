//! Real maps, broken as authors and tools break them, and changed within what is allowed: see
//! `qcbus_sdk::mutate::seeded` and `tests/seeded/README.md`.

use std::path::Path;

use qcbus_sdk::mutate::seeded::Study;
use qcbus_xodr::BUNDLE;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

#[test]
fn faults_are_found_and_harmless_variants_are_not_rejected() {
    let root = Path::new(ROOT);
    let study = Study {
        bundle: &BUNDLE,
        what: "maps",
        key: "id",
        faults: include_str!("seeded/faults.txt"),
        harmless: include_str!("seeded/harmless.txt"),
        place: "bundles/xodr/tests/seeded",
        shared: &root.join("../shared/cases/real"),
        fetched: "QCBUS_MAPS",
        page: &root.join("docs/evidence/seeded-maps.md"),
        least: 60,
    };
    study.run();
}
