//! Faults of the files of a modular scenario, grouped by the rules that report them.

use std::collections::BTreeSet;

use crate::assembly::Assembly;
use crate::prelude::*;
use qcbus_document::Fault;

/// Faults that prevent reading an archive or using it as a modular scenario.
pub const ARCHIVE: &[FaultCode] = &[
    FaultCode::ArchiveTruncated,
    FaultCode::ArchiveMalformed,
    FaultCode::ArchiveMemberMissing,
];

/// Faults about the limits for unpacked data.
pub const LIMITS: &[FaultCode] = &[
    FaultCode::ArchiveLimit,
    FaultCode::UnpackedLimit,
    FaultCode::RatioLimit,
];

/// Faults about the names of members.
pub const NAMES: &[FaultCode] = &[
    FaultCode::ArchiveEscapes,
    FaultCode::ArchiveBackslash,
    FaultCode::ArchiveDuplicate,
];

/// Faults about document type declarations.
pub const DOCTYPES: &[FaultCode] = &[FaultCode::Doctype];

/// Returns the faults of the given kinds in all scenarios.
pub fn of<'d>(
    assembly: &Assembly<'d>,
    sorts: &'static [FaultCode],
) -> impl Iterator<Item = (Document<'d>, Fault<'d>)> {
    assembly.scenarios().flat_map(move |document| {
        let faults = document.faults();
        faults
            .filter(|fault| sorts.contains(&fault.code))
            .map(move |fault| (document, fault))
    })
}

/// Returns the faults of archives, without those of plain or gzipped files with the same codes. A
/// fault of a whole archive is a fault of each member. It is returned only for the first member.
pub fn of_archives<'d>(
    assembly: &Assembly<'d>,
    sorts: &'static [FaultCode],
) -> impl Iterator<Item = (Document<'d>, Fault<'d>)> {
    let mut said = BTreeSet::new();
    of(assembly, sorts).filter(move |(document, fault)| {
        archive_of(document.path()).is_some_and(|archive| said.insert((archive, fault.text)))
    })
}

/// Checks whether a separate rule reports why a document cannot be used as it is.
pub fn has_own_rule(document: Document<'_>) -> bool {
    let in_archive = archive_of(document.path()).is_some();
    let mut faults = document.faults().filter(|fault| {
        // Faults about names do not prevent the use of a scenario.
        fault.code.makes_partial() && !NAMES.contains(&fault.code)
    });
    faults.next().is_some_and(|fault| {
        let of_archive = ARCHIVE.contains(&fault.code) || LIMITS.contains(&fault.code);
        DOCTYPES.contains(&fault.code) || (in_archive && of_archive)
    })
}
