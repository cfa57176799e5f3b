//! The checker bundle for ASAM OpenDRIVE.
//!
//! Each rule has its own file in `rules/` with its page beside it. `rules/mod.rs` is the list.
//! `docs/writing-a-rule.md` shows how to add a rule.

mod families;
mod model;
mod prelude;
mod rules;
mod sections;

pub use sections::section;

use qcbus_document::FileKind;
use qcbus_sdk::{Bundle, Version, basic};

/// The bundle.
pub static BUNDLE: Bundle = Bundle {
    name: "xodrBundle",
    alias: "xodr",
    version: env!("CARGO_PKG_VERSION"),
    description: "ASAM OpenDRIVE: road networks",
    standard: "OpenDRIVE",
    kinds: &[FileKind::Xodr],
    versions: &[
        Version::new(1, 4),
        Version::new(1, 5),
        Version::new(1, 6),
        Version::new(1, 7),
        Version::new(1, 8),
        Version::new(1, 9),
    ],
    reads: qcbus_sdk::Reads::Written,
    version_of: |document| basic::version_of(document, "header"),
    rules: rules::RULES,
};
