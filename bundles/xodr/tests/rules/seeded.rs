//! Tests with real maps, broken as authors and tools break them, and changed within the allowed
//! range. See `qcbus_rule_tests::mutate::seeded` and `tests/rules/seeded/README.md`.

use std::path::Path;

use qcbus_rule_tests::mutate::seeded::Study;
use qcbus_xodr::BUNDLE;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Runs a study of maps. `least` is the percentage of the faults that must be found at the required
/// level.
fn run(place: &'static str, lists: [&str; 2], page: &str, least: usize) {
    let root = Path::new(ROOT);
    let [faults, harmless] = lists;
    let study = Study {
        bundle: &BUNDLE,
        what: "maps",
        key: "id",
        faults,
        harmless,
        place,
        shared: &root.join("../shared/cases/real"),
        fetched: "QCBUS_MAPS",
        page: &root.join("docs/evidence").join(page),
        least,
    };
    study.run();
}

#[test]
fn faults_are_found_and_harmless_variants_are_not_rejected() {
    let lists = [
        include_str!("seeded/faults.txt"),
        include_str!("seeded/harmless.txt"),
    ];
    run(
        "bundles/xodr/tests/rules/seeded",
        lists,
        "seeded-maps.md",
        95,
    );
}

#[test]
fn held_out_faults_are_found() {
    let lists = [
        include_str!("held-out/faults.txt"),
        include_str!("held-out/harmless.txt"),
    ];
    run(
        "bundles/xodr/tests/rules/held-out",
        lists,
        "held-out-maps.md",
        90,
    );
}

#[test]
fn unseen_fresh_faults_are_found() {
    let lists = [
        include_str!("fresh/faults.txt"),
        include_str!("fresh/harmless.txt"),
    ];
    run("bundles/xodr/tests/rules/fresh", lists, "fresh-maps.md", 80);
}
