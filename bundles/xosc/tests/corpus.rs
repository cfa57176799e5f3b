//! The recorded results of ASAM's own OpenSCENARIO bundle, where they are at hand.

use std::path::Path;

use qcbus_sdk::corpus::{Deviation, assert_asam_cases};

const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases");

/// Where we differ, and why ours is right.
const DEVIATIONS: &[Deviation] = &[];

#[test]
fn agrees_with_the_recorded_cases() {
    assert_asam_cases(&qcbus_xosc::BUNDLE, Path::new(CASES), DEVIATIONS);
}
