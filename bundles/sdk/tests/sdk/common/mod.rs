//! Common parts of the tests' bundles.

use qcbus_document::FileKind;
use qcbus_sdk::{Bundle, Version, basic};

/// A bundle for OpenDRIVE without rules.
pub const BUNDLE: Bundle = Bundle {
    name: "testBundle",
    alias: "test",
    version: "0",
    description: "rules for tests",
    standard: "OpenDRIVE",
    kinds: &[FileKind::Xodr],
    versions: &[Version::new(1, 4)],
    reads: qcbus_sdk::Reads::Written,
    version_of: |document| basic::version_of(document, "header"),
    rules: &[],
};
