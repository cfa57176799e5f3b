//! Counting beforehand: from upper bounds to the places of the sections.

use crate::layout::{ALIGNMENT, Header, HeapRecord, LINE_STRIDE, SECTIONS, Section};

/// How much of each thing a file has at most.
///
/// Counting too much costs address space but no memory: what is not used is never touched.
/// Counting too little ends in [`NoRoom`](crate::BuildError::NoRoom).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capacities {
    /// Bytes of all sources together.
    pub text: usize,
    /// Elements and runs of character data that are not just white space.
    pub nodes: usize,
    /// Attributes.
    pub attributes: usize,
    /// Distinct names of elements and attributes; more than [`Capacities::MAX_NAMES`] never fit.
    pub names: usize,
    /// Bytes of paths, fault texts and resolved values, plus [`Capacities::PER_RESOLVED`] for each
    /// of the latter.
    pub heap: usize,
    /// Files.
    pub sources: usize,
    /// Faults.
    pub faults: usize,
}

impl Capacities {
    /// As many distinct names as an image can hold.
    pub const MAX_NAMES: usize = super::names::MAX_NAMES;
    /// Heap bytes that each resolved value takes besides its own.
    pub const PER_RESOLVED: usize = size_of::<HeapRecord>();

    /// Bytes that the builder's buffer needs, an upper bound of the image.
    pub fn image_len(&self) -> usize {
        let (places, lens) = self.places();
        places[SECTIONS - 1].saturating_add(lens[SECTIONS - 1])
    }

    /// Offsets and lengths of the sections of a full image.
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

/// Offsets and byte lengths of sections with these numbers of records.
pub(super) fn place(counts: &[usize; SECTIONS]) -> ([usize; SECTIONS], [usize; SECTIONS]) {
    let (mut places, mut lens) = ([0; SECTIONS], [0; SECTIONS]);
    let mut end = size_of::<Header>();
    for (number, (_, record)) in Section::ALL.iter().enumerate() {
        // Saturated sums are larger than any buffer and end in `NoRoom`.
        places[number] = end
            .checked_next_multiple_of(ALIGNMENT)
            .unwrap_or(usize::MAX);
        lens[number] = counts[number].saturating_mul(*record);
        end = places[number].saturating_add(lens[number]);
    }
    (places, lens)
}
