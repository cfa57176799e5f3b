//! Caps on the cost of one file, and the common text for an exceeded cap.

use std::fmt;

const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;

/// Caps on the cost of one root file and of everything read for it. All caps are data, so that a
/// farm with larger maps can raise them. [`Limits::default`] suits files up to a gigabyte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Maximum size of a file on disk, in bytes.
    pub max_file: u64,
    /// Maximum size of the text after inflating a gzip file or decoding another encoding, in bytes.
    pub max_unpacked: u64,
    /// Maximum sum of the inflated members of a `.mosc` archive, in bytes.
    pub max_archive: u64,
    /// Maximum ratio of inflated to packed bytes. It applies from the first inflated mebibyte on.
    pub max_ratio: u32,
    /// Maximum number of members of a `.mosc` archive.
    pub max_members: u32,
    /// Maximum nesting depth of elements. The root is at depth 1.
    pub max_depth: u16,
    /// Maximum number of `<include>` elements spliced into one document. Nested ones count each
    /// time.
    pub max_includes: u32,
    /// Maximum size of a document image, in bytes.
    pub max_image: u64,
    /// Maximum number of faults recorded in one document. Reading stops at the first one beyond it.
    pub max_faults: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            max_file: GIB,
            max_unpacked: GIB,
            max_archive: 64 * MIB,
            max_ratio: 200,
            max_members: 1000,
            max_depth: 1024,
            max_includes: 1000,
            max_image: 3 * GIB,
            max_faults: 64,
        }
    }
}

/// An exceeded cap: its name in [`Limits`], the value found and the value allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exceeded {
    /// Field of [`Limits`] to raise.
    pub limit: &'static str,
    /// Counted unit: `bytes on disk`, `members`, …
    pub what: &'static str,
    /// Value found. It is a lower bound if counting stopped at the cap.
    pub found: u64,
    /// Maximum value allowed.
    pub allowed: u64,
}

impl fmt::Display for Exceeded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Exceeded {
            limit,
            what,
            found,
            allowed,
        } = self;
        write!(
            f,
            "{found} {what}, {allowed} are allowed; raise the limit {limit} to read it"
        )
    }
}

impl Exceeded {
    /// Returns `Err` when `found` is above `allowed`.
    pub(crate) fn check(
        limit: &'static str,
        what: &'static str,
        found: u64,
        allowed: u64,
    ) -> Result<(), Exceeded> {
        if found > allowed {
            Err(Exceeded {
                limit,
                what,
                found,
                allowed,
            })
        } else {
            Ok(())
        }
    }
}
