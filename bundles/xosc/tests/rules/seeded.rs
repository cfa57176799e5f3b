//! Tests with real scenarios, broken as authors and tools break them, and changed within the
//! allowed range. See `qcbus_rule_tests::mutate::seeded` and `tests/rules/seeded/README.md`.

use std::path::Path;

use qcbus_rule_tests::mutate::seeded::Study;
use qcbus_xosc::BUNDLE;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

#[test]
fn faults_are_found_and_harmless_variants_are_not_rejected() {
    let root = Path::new(ROOT);
    let study = Study {
        bundle: &BUNDLE,
        what: "scenarios",
        key: "name",
        faults: include_str!("seeded/faults.txt"),
        harmless: include_str!("seeded/harmless.txt"),
        place: "bundles/xosc/tests/rules/seeded",
        shared: &root.join("../shared/cases/real"),
        fetched: "QCBUS_SCENARIOS",
        page: &root.join("docs/evidence/seeded-scenarios.md"),
        least: 85,
    };
    study.run();
}
