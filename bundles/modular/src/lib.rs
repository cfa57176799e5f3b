//! The checker bundle for modular scenarios. These are OpenSCENARIO files that take maneuver groups
//! from other files by `ScenarioReference`, and their archives (`.mosc`).
//!
//! The bundle checks how a scenario is put together. The bundle for OpenSCENARIO checks the
//! expanded scenario.
//!
//! Each rule is one file in `rules/` with its page beside it; `rules/mod.rs` is the list.

mod assembly;
mod families;
mod prelude;
mod rules;

use qcbus_document::FileKind;
use qcbus_sdk::{Bundle, Reads, Version, basic};

/// The bundle.
pub static BUNDLE: Bundle = Bundle {
    name: "modularBundle",
    alias: "modular",
    version: env!("CARGO_PKG_VERSION"),
    description: "Modular scenarios: references, keys and archives, before they are expanded",
    standard: "OpenSCENARIO",
    kinds: &[FileKind::Xosc, FileKind::Mosc],
    reads: Reads::Written,
    versions: &[
        Version::new(1, 0),
        Version::new(1, 1),
        Version::new(1, 2),
        Version::new(1, 3),
        Version::new(1, 4),
    ],
    version_of: |document| basic::version_of(document, "FileHeader"),
    rules: rules::RULES,
};
