//! Capacities: computes the offsets of the sections from upper bounds.

use crate::layout::{ALIGNMENT, Header, HeapRecord, LINE_STRIDE, SECTIONS, Section};

/// Upper bounds for the content of a file.
///
/// A count that is too high costs address space but no memory, because unused memory is never
/// touched. A count that is too low leads to [`NoRoom`](crate::BuildError::NoRoom).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capacities {
    /// Bytes of all sources together.
    pub text: usize,
    /// Elements and runs of character data that are not just white space.
    pub nodes: usize,
    /// Number of attributes.
    pub attributes: usize,
    /// Distinct names of elements and attributes; more than [`Capacities::MAX_NAMES`] never fit.
    pub names: usize,
    /// Bytes of paths, fault texts and resolved values, plus [`Capacities::PER_RESOLVED`] for each
    /// resolved value.
    pub heap: usize,
    /// Number of files.
    pub sources: usize,
    /// Number of faults.
    pub faults: usize,
}

impl Capacities {
    /// Maximum number of distinct names in an image.
    pub const MAX_NAMES: usize = super::names::MAX_NAMES;
    /// Heap bytes that each resolved value takes in addition to its own.
    pub const PER_RESOLVED: usize = size_of::<HeapRecord>();

    /// Returns the bytes that the builder's buffer needs, an upper bound of the image.
    pub fn image_len(&self) -> usize {
        let (places, lens) = self.places();
        places[SECTIONS - 1].saturating_add(lens[SECTIONS - 1])
    }

    /// Returns the offsets and lengths of the sections of a full image.
    pub(super) fn places(&self) -> ([usize; SECTIONS], [usize; SECTIONS]) {
        let text = self.text.saturating_add(self.sources);
        let names = self.names.min(Self::MAX_NAMES);
        let counts = [
            text,
            self.nodes,
            self.attributes,
            names,
            names,
            self.nodes,
            text / LINE_STRIDE + 1,
            self.sources,
            self.faults,
            self.heap,
        ];
        place(&counts)
    }
}

/// Returns the offsets and byte lengths of sections with these numbers of records.
pub(super) fn place(counts: &[usize; SECTIONS]) -> ([usize; SECTIONS], [usize; SECTIONS]) {
    let (mut places, mut lens) = ([0; SECTIONS], [0; SECTIONS]);
    let mut end = size_of::<Header>();
    for (number, (_, record)) in Section::ALL.iter().enumerate() {
        // Saturated sums exceed every buffer and lead to `NoRoom`.
        places[number] = end
            .checked_next_multiple_of(ALIGNMENT)
            .unwrap_or(usize::MAX);
        lens[number] = counts[number].saturating_mul(*record);
        end = places[number].saturating_add(lens[number]);
    }
    (places, lens)
}
