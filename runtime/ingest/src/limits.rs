//! Caps on what one file may cost, and the one text that says a cap was hit.

use std::fmt;

const MIB: u64 = 1 << 20;
const GIB: u64 = 1 << 30;

/// Caps on what one root file and everything read for it may cost. All of them are data, so that
/// a farm with larger maps can raise them; [`Limits::default`] suits files up to a gigabyte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest file on disk, in bytes.
    pub max_file: u64,
    /// Largest text after inflating a gzip file or decoding another encoding, in bytes.
    pub max_unpacked: u64,
    /// Largest sum of the inflated members of a `.mosc` archive, in bytes.
    pub max_archive: u64,
    /// Largest ratio of inflated to packed bytes; counts from the first inflated mebibyte on.
    pub max_ratio: u32,
    /// Most members of a `.mosc` archive, and most files listed in a catalog directory.
    pub max_members: u32,
    /// Deepest nesting of elements; the root is at depth 1.
    pub max_depth: u16,
    /// Most `<include>` elements spliced into one document, nested ones counted each time.
    pub max_includes: u32,
    /// Largest document image, in bytes.
    pub max_image: u64,
    /// Faults recorded in one document; reading stops at the last of them.
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

/// A cap that was exceeded: its name in [`Limits`], what was found and what is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exceeded {
    /// The field of [`Limits`] to raise.
    pub limit: &'static str,
    /// What is counted: `bytes on disk`, `members`, …
    pub what: &'static str,
    /// The value found; a lower bound where counting stopped at the cap.
    pub found: u64,
    /// The value allowed.
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
    /// `Err` when `found` is above `allowed`.
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
