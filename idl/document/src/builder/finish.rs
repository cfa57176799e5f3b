//! Completion of an image: moves the sections together and derives postings and line checkpoints.

use bytemuck::Pod;

use super::capacities::place;
use super::{BuildError, ImageBuilder};
use crate::layout::{
    ELEMENT, Extent, Header, LineRecord, MAGIC, NameRecord, NodeRecord, SECTIONS, Section,
    SourceRecord, U16, U32, U64, VERSION,
};
use crate::lines;

impl ImageBuilder<'_> {
    /// Closes the open elements, completes the image and returns its length from the start of the
    /// buffer. `content_hash` is the hash of the source bytes.
    ///
    /// # Errors
    /// Fails if an open element cannot be closed, which earlier checks exclude.
    pub fn finish(mut self, content_hash: [u8; 32]) -> Result<usize, BuildError> {
        while !self.open.is_empty() {
            self.close_element(self.text_len())?;
        }
        let names = self.names.records();
        let elements: u32 = names.iter().map(|name| name.postings.get()).sum();
        let counts = self.counts(elements as usize);
        let (places, lens) = place(&counts);
        let total = places[SECTIONS - 1] + lens[SECTIONS - 1];
        self.move_section(Section::Nodes, &places);
        self.move_section(Section::Attributes, &places);
        self.write_records(Section::Names, &places, names.iter().copied());
        let order = self.names.order();
        self.write_records(Section::NameOrder, &places, order.into_iter().map(U16::new));
        self.write_postings(&places, &names);
        self.write_lines(&places);
        self.move_section(Section::Sources, &places);
        self.move_section(Section::Faults, &places);
        self.move_section(Section::Heap, &places);
        self.clear_gaps(&places, &lens);
        self.write_header(&places, &lens, total, content_hash);
        Ok(total)
    }

    fn counts(&self, elements: usize) -> [usize; SECTIONS] {
        let mut counts = [0; SECTIONS];
        for (count, (section, record)) in counts.iter_mut().zip(Section::ALL) {
            *count = match section {
                Section::Names | Section::NameOrder => self.names.len(),
                Section::Postings => elements,
                Section::Lines => {
                    self.text_len().div_ceil(crate::layout::LINE_STRIDE as u32) as usize
                }
                _ => self.used[section as usize] / record,
            };
        }
        counts
    }

    fn move_section(&mut self, section: Section, places: &[usize; SECTIONS]) {
        let from = self.places[section as usize];
        let to = places[section as usize];
        if from != to {
            self.out
                .copy_within(from..from + self.used[section as usize], to);
        }
    }

    fn write_records<T: Pod>(
        &mut self,
        section: Section,
        places: &[usize; SECTIONS],
        records: impl Iterator<Item = T>,
    ) {
        let out = self
            .out
            .get_mut(places[section as usize]..)
            .unwrap_or(&mut []);
        for (slot, record) in out.chunks_exact_mut(size_of::<T>()).zip(records) {
            slot.copy_from_slice(bytemuck::bytes_of(&record));
        }
    }

    /// Writes the postings in one pass over the nodes, in document order for each name.
    fn write_postings(&mut self, places: &[usize; SECTIONS], names: &[NameRecord]) {
        let mut next: Vec<u32> = names.iter().map(|name| name.first_posting.get()).collect();
        let (head, tail) = self.out.split_at_mut(places[Section::Postings as usize]);
        let nodes = &head[places[Section::Nodes as usize]..][..self.used[Section::Nodes as usize]];
        let nodes: &[NodeRecord] = bytemuck::try_cast_slice(nodes).unwrap_or(&[]);
        let room = tail.len() / size_of::<U32>() * size_of::<U32>();
        let postings: &mut [U32] =
            bytemuck::try_cast_slice_mut(&mut tail[..room]).unwrap_or(&mut []);
        for (index, node) in (0..)
            .zip(nodes)
            .filter(|(_, node)| node.kind.get() == ELEMENT)
        {
            let slot = &mut next[usize::from(node.name.get())];
            postings[*slot as usize] = U32::new(index);
            *slot += 1;
        }
    }

    fn write_lines(&mut self, places: &[usize; SECTIONS]) {
        let sources = self.places[Section::Sources as usize];
        let sources = &self.out[sources..sources + self.used[Section::Sources as usize]];
        let sources: &[SourceRecord] = bytemuck::try_cast_slice(sources).unwrap_or(&[]);
        let starts: Vec<usize> = sources
            .iter()
            .map(|source| source.start.get() as usize)
            .collect();
        let (head, tail) = self.out.split_at_mut(places[Section::Lines as usize]);
        let text = &head[places[Section::Text as usize]..][..self.used[Section::Text as usize]];
        for (slot, line) in tail
            .chunks_exact_mut(size_of::<LineRecord>())
            .zip(lines::checkpoints(text, starts.into_iter()))
        {
            slot.copy_from_slice(bytemuck::bytes_of(&line));
        }
    }

    /// Fills the gaps between sections with zeros, so that equal files produce equal images.
    fn clear_gaps(&mut self, places: &[usize; SECTIONS], lens: &[usize; SECTIONS]) {
        for number in 1..SECTIONS {
            self.out[places[number - 1] + lens[number - 1]..places[number]].fill(0);
        }
    }

    fn write_header(
        &mut self,
        places: &[usize; SECTIONS],
        lens: &[usize; SECTIONS],
        total: usize,
        content_hash: [u8; 32],
    ) {
        let extent = |number: usize| Extent {
            offset: U64::new(places[number] as u64),
            len: U64::new(lens[number] as u64),
        };
        let header = Header {
            magic: MAGIC,
            version: U32::new(VERSION),
            flags: U32::new(0),
            total: U64::new(total as u64),
            content_hash,
            extents: std::array::from_fn(extent),
            reserved: [U64::new(0); 5],
        };
        self.out[..size_of::<Header>()].copy_from_slice(bytemuck::bytes_of(&header));
    }
}
