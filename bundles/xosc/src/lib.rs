//! The checker bundle for ASAM OpenSCENARIO XML.
//!
//! Each rule is one file in `rules/` with its page beside it. `rules/mod.rs` is the list.
//! Algorithms that several rules share are in `families/`. `docs/writing-a-rule.md` shows how to
//! add a rule.

mod families;
mod model;
mod prelude;
mod rules;
mod story;

use qcbus_document::FileKind;
use qcbus_sdk::{Bundle, Version, basic};

pub use story::story;

/// The bundle.
pub static BUNDLE: Bundle = Bundle {
    name: "xoscBundle",
    alias: "xosc",
    version: env!("CARGO_PKG_VERSION"),
    description: "ASAM OpenSCENARIO XML: scenarios, catalogs and parameter distributions",
    standard: "OpenSCENARIO",
    kinds: &[FileKind::Xosc, FileKind::Mosc],
    versions: &[
        Version::new(1, 0),
        Version::new(1, 1),
        Version::new(1, 2),
        Version::new(1, 3),
        Version::new(1, 4),
    ],
    reads: qcbus_sdk::Reads::Expanded,
    version_of: |document| basic::version_of(document, "FileHeader"),
    rules: rules::RULES,
};
