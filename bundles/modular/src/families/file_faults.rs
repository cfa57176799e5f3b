//! Faults of the files that a modular scenario is made of, by the rule that says them.

use std::collections::BTreeSet;

use qcbus_document::{Document, Fault, FaultCode};

use crate::assembly::Assembly;
use qcbus_sdk::modular::archive_of;

/// What keeps an archive from being read, or from being a modular scenario.
pub const ARCHIVE: &[FaultCode] = &[
    FaultCode::ArchiveTruncated,
    FaultCode::ArchiveMalformed,
    FaultCode::ArchiveMemberMissing,
];

/// Bounds of what is unpacked.
pub const LIMITS: &[FaultCode] = &[
    FaultCode::ArchiveLimit,
    FaultCode::UnpackedLimit,
    FaultCode::RatioLimit,
];

/// Names of members.
pub const NAMES: &[FaultCode] = &[FaultCode::ArchiveEscapes, FaultCode::ArchiveDuplicate];

/// Document type declarations.
pub const DOCTYPES: &[FaultCode] = &[FaultCode::Doctype];

/// The faults of some sorts in all the scenarios.
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

/// The faults of archives: those of plain or gzipped files bear the same codes. What is wrong with an
/// archive as a whole is a fault of each of its members, and here only of the first.
pub fn of_archives<'d>(
    assembly: &Assembly<'d>,
    sorts: &'static [FaultCode],
) -> impl Iterator<Item = (Document<'d>, Fault<'d>)> {
    let mut said = BTreeSet::new();
    of(assembly, sorts).filter(move |(document, fault)| {
        archive_of(document.path()).is_some_and(|archive| said.insert((archive, fault.text)))
    })
}

/// Whether a rule of its own says why a document cannot be taken as it is.
pub fn has_own_rule(document: Document<'_>) -> bool {
    let in_archive = archive_of(document.path()).is_some();
    let mut faults = document.faults().filter(|fault| {
        // These do not keep a scenario from being taken.
        fault.code.makes_partial() && !NAMES.contains(&fault.code)
    });
    faults.next().is_some_and(|fault| {
        let of_archive = ARCHIVE.contains(&fault.code) || LIMITS.contains(&fault.code);
        DOCTYPES.contains(&fault.code) || (in_archive && of_archive)
    })
}
