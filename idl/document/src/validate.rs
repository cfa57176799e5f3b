//! Validation of an image against the text it carries.
//!
//! Opening makes an image safe to read. Validation checks that every record equals the one the
//! builder would write. Each accessor then returns a correct value instead of "absent" or empty.

use std::ops::Range;

use bytemuck::Pod;

use crate::document::{Document, ImageError};
use crate::fault::FaultCode;
use crate::layout::{
    AttributeRecord, ELEMENT, FaultRecord, LINE_STRIDE, LineRecord, NAME_IN_HEAP, NONE, NameRecord,
    NodeRecord, RESOLVED_TEXT, Section, SourceRecord, TEXT, U16, U32,
};
use crate::lines;

impl Document<'_> {
    /// Checks every record against the text and against the other records. The cost is linear in
    /// the size of the image.
    ///
    /// # Errors
    /// The first contradiction found.
    pub fn validate(&self) -> Result<(), ImageError> {
        let mut image = Image::of(self)?;
        image.check_text()?;
        image.check_sources()?;
        image.check_names()?;
        image.check_nodes()?;
        image.check_attributes()?;
        image.check_faults()
    }
}

/// All sections, as slices.
struct Image<'a> {
    text: &'a [u8],
    /// True when the text is pure ASCII, so that no range can cut a character.
    is_ascii: bool,
    heap: &'a [u8],
    nodes: &'a [NodeRecord],
    attributes: &'a [AttributeRecord],
    names: &'a [NameRecord],
    order: &'a [U16],
    postings: &'a [U32],
    lines: &'a [LineRecord],
    sources: &'a [SourceRecord],
    faults: &'a [FaultRecord],
    document: &'a Document<'a>,
}

/// Returns a contradiction error for the record at `index` of `section`, unless `sound`.
#[inline]
fn demand(
    sound: bool,
    section: Section,
    index: usize,
    what: &'static str,
) -> Result<(), ImageError> {
    if sound {
        return Ok(());
    }
    Err(ImageError::Contradiction {
        section: section.name(),
        index: index as u64,
        what,
    })
}

impl<'a> Image<'a> {
    fn of(document: &'a Document<'a>) -> Result<Image<'a>, ImageError> {
        let text = document.section(Section::Text);
        demand(
            u32::try_from(text.len()).is_ok(),
            Section::Text,
            0,
            "the text is longer than 4 GiB",
        )?;
        Ok(Image {
            text,
            is_ascii: false,
            heap: document.section(Section::Heap),
            nodes: records(document, Section::Nodes)?,
            attributes: records(document, Section::Attributes)?,
            names: records(document, Section::Names)?,
            order: records(document, Section::NameOrder)?,
            postings: records(document, Section::Postings)?,
            lines: records(document, Section::Lines)?,
            sources: records(document, Section::Sources)?,
            faults: records(document, Section::Faults)?,
            document,
        })
    }

    fn check_sources(&self) -> Result<(), ImageError> {
        let mut end = 0;
        for (index, source) in self.sources.iter().enumerate() {
            let check = |sound, what| demand(sound, Section::Sources, index, what);
            let expected = if index == 0 { 0 } else { end + 1 };
            let start = source.start.get() as usize;
            check(
                start == expected,
                "the file does not start where the previous one ends",
            )?;
            check(
                index == 0 || self.text.get(end) == Some(&b'\n'),
                "no line feed between two files",
            )?;
            end = start + source.len.get() as usize;
            check(self.is_text(start, end), "the file is not within the text")?;
            check(
                self.heap_str(source.path_offset, source.path_len).is_some(),
                "the path is not within the heap",
            )?;
        }
        demand(
            end == self.text.len(),
            Section::Sources,
            self.sources.len(),
            "the end of the text belongs to no file",
        )
    }

    /// Checks encoding and line checkpoints stride by stride, so that each byte is fetched only
    /// once.
    fn check_text(&mut self) -> Result<(), ImageError> {
        let starts = self
            .sources
            .iter()
            .map(|source| source.start.get() as usize);
        let mut known = self.lines.iter();
        let (mut decoded, mut is_ascii) = (0, true);
        for (index, line) in lines::checkpoints(self.text, starts).enumerate() {
            let stop = ((index + 1) * LINE_STRIDE).min(self.text.len());
            is_ascii &= self.text[decoded..stop].is_ascii();
            if is_ascii {
                decoded = stop;
            } else {
                decoded += decodable(self.text, decoded, stop)?;
            }
            let what = "lines or characters are counted incorrectly";
            demand(known.next() == Some(&line), Section::Lines, index, what)?;
        }
        self.is_ascii = is_ascii;
        demand(
            known.next().is_none(),
            Section::Lines,
            self.lines.len(),
            "there are more records than the text needs",
        )
    }

    fn check_names(&self) -> Result<(), ImageError> {
        demand(
            self.order.len() == self.names.len(),
            Section::NameOrder,
            0,
            "the number of entries differs from the number of names",
        )?;
        demand(
            self.names.len() <= crate::Capacities::MAX_NAMES,
            Section::Names,
            self.names.len(),
            "too many names",
        )?;
        let mut before = "";
        for (index, id) in self.order.iter().enumerate() {
            let record = self.names.get(usize::from(id.get()));
            let name = record.and_then(|record| self.document.name_of(record));
            // Strictly ascending names are distinct, so their ids are a permutation.
            demand(
                name.is_some_and(|name| before < name),
                Section::NameOrder,
                index,
                "the names are not in order",
            )?;
            before = name.unwrap_or("");
        }
        let sound = |record: &NameRecord| {
            let (offset, len) = (record.offset.get() as usize, record.len.get());
            len & NAME_IN_HEAP != 0 || self.is_text(offset, offset + len as usize)
        };
        match self.names.iter().position(|record| !sound(record)) {
            Some(index) => demand(
                false,
                Section::Names,
                index,
                "the name is not within the text",
            ),
            None => Ok(()),
        }
    }

    fn check_nodes(&self) -> Result<(), ImageError> {
        let len = self.nodes.len() as u32;
        let attributes = self.attributes.len();
        let mut next_posting = self.posting_ranges()?;
        for (index, node) in self.nodes.iter().enumerate() {
            let check = |sound, what| demand(sound, Section::Nodes, index, what);
            let next = self
                .nodes
                .get(index + 1)
                .map_or(attributes, |next| next.first_attribute.get() as usize);
            let first = node.first_attribute.get() as usize;
            check(
                first <= next && (index > 0 || first == 0),
                "the attributes are not in order",
            )?;
            let end = node.end.get();
            if node.kind.get() == ELEMENT {
                let posting = next_posting.get_mut(usize::from(node.name.get()));
                check(
                    posting.is_some_and(|posting| self.is_posted(posting, index)),
                    "it has no posting under its name",
                )?;
                check(
                    self.is_text(node.start.get() as usize, node.start.get() as usize),
                    "it starts outside the text",
                )?;
                check(
                    self.is_text(node.stop.get() as usize, node.stop.get() as usize),
                    "it ends outside the text",
                )?;
            } else {
                check(
                    end as usize == index + 1 && first == next,
                    "character data has children or attributes",
                )?;
                check(
                    self.is_character_data(node),
                    "the character data is not within text or heap",
                )?;
            }
            check(
                end as usize > index && end <= len,
                "the subtree ends outside the document",
            )?;
            check(self.is_nested(index, node), "it is not within its parent")?;
        }
        // Every element used one posting of its own name, so equal totals exclude extra postings.
        let elements = self
            .nodes
            .iter()
            .filter(|node| node.kind.get() == ELEMENT)
            .count();
        demand(
            self.postings.len() == elements,
            Section::Postings,
            elements,
            "there are more postings than elements",
        )
    }

    /// Returns the postings of each name; the ranges must have neither gap nor overlap.
    fn posting_ranges(&self) -> Result<Vec<Range<usize>>, ImageError> {
        let mut first = 0;
        let mut ranges = Vec::with_capacity(self.names.len());
        for (id, name) in self.names.iter().enumerate() {
            let what = "its elements do not follow those of the previous name";
            demand(
                name.first_posting.get() as usize == first,
                Section::Names,
                id,
                what,
            )?;
            let end = first + name.postings.get() as usize;
            ranges.push(first..end);
            first = end;
        }
        demand(
            first == self.postings.len(),
            Section::Postings,
            first,
            "not every posting belongs to a name",
        )?;
        Ok(ranges)
    }

    /// Takes the next posting of a name and checks whether it is the element at `index`.
    fn is_posted(&self, left: &mut Range<usize>, index: usize) -> bool {
        let posting = left.next().and_then(|place| self.postings.get(place));
        posting.is_some_and(|posted| posted.get() as usize == index)
    }

    /// Checks whether the node's parent is the innermost element that has not ended before it. The
    /// search starts at the previous node. It leaves each element once, so all nodes take one pass.
    fn is_nested(&self, index: usize, node: &NodeRecord) -> bool {
        if index == 0 {
            return node.parent.get() == NONE
                && node.kind.get() == ELEMENT
                && node.end.get() as usize == self.nodes.len();
        }
        let mut outer = index - 1;
        // Parents come before their children in a valid image. Each step checks this again.
        // Otherwise a concurrent change of the image could cause an endless loop.
        loop {
            let Some(before) = self.nodes.get(outer) else {
                return false;
            };
            let (parent, end) = (before.parent.get() as usize, before.end.get());
            if end as usize > index {
                return node.parent.get() as usize == outer && node.end.get() <= end;
            }
            if parent >= outer {
                return false;
            }
            outer = parent;
        }
    }

    fn is_character_data(&self, node: &NodeRecord) -> bool {
        let (start, stop) = (node.start.get() as usize, node.stop.get() as usize);
        match node.kind.get() {
            TEXT => start <= stop && self.is_text(start, stop),
            RESOLVED_TEXT => self.resolved_from(node.stop) == Some(node.start.get()),
            _ => false,
        }
    }

    fn check_attributes(&self) -> Result<(), ImageError> {
        for (index, attribute) in self.attributes.iter().enumerate() {
            let check = |sound, what| demand(sound, Section::Attributes, index, what);
            let offset = attribute.offset.get() as usize;
            check(
                usize::from(attribute.name.get()) < self.names.len(),
                "the name does not exist",
            )?;
            check(self.is_text(offset, offset), "it is not within the text")?;
            let value = match attribute.value_delta.get() {
                0 => self.resolved_from(attribute.value_len).is_some(),
                delta => {
                    let start = offset + usize::from(delta);
                    self.is_text(start, start + attribute.value_len.get() as usize)
                }
            };
            check(value, "the value is not within text or heap")?;
        }
        Ok(())
    }

    fn check_faults(&self) -> Result<(), ImageError> {
        for (index, fault) in self.faults.iter().enumerate() {
            let check = |sound, what| demand(sound, Section::Faults, index, what);
            check(FaultCode::of_record(fault).is_some(), "the code is unknown")?;
            check(
                fault.offset.get() as usize <= self.text.len(),
                "it is not within the text",
            )?;
            check(
                self.heap_str(fault.text_offset, fault.text_len).is_some(),
                "its text is not within the heap",
            )?;
        }
        Ok(())
    }

    /// Checks whether the range lies within the text and cuts no character.
    #[inline]
    fn is_text(&self, start: usize, stop: usize) -> bool {
        if self.is_ascii {
            return start <= stop && stop <= self.text.len();
        }
        start <= stop && self.is_boundary(start) && self.is_boundary(stop)
    }

    fn is_boundary(&self, at: usize) -> bool {
        self.text
            .get(at)
            .map_or(at == self.text.len(), |byte| byte & 0xC0 != 0x80)
    }

    fn heap_str(&self, offset: U32, len: U32) -> Option<&'a str> {
        let bytes = self
            .heap
            .get(offset.get() as usize..)?
            .get(..len.get() as usize)?;
        std::str::from_utf8(bytes).ok()
    }

    /// Returns the text offset of a resolved value, if heap and text contain it.
    fn resolved_from(&self, place: U32) -> Option<u32> {
        let (_, offset, raw_len) = self.document.heap_value(place.get())?;
        self.is_text(offset as usize, offset as usize + raw_len as usize)
            .then_some(offset)
    }
}

/// Returns the records of a section, which must hold a whole number of them.
fn records<'a, T: Pod>(document: &Document<'a>, section: Section) -> Result<&'a [T], ImageError> {
    let bytes = document.section(section);
    bytemuck::try_cast_slice(bytes).map_err(|_| ImageError::Section {
        section: section.name(),
    })
}

/// Returns how many bytes from `start` to `stop` are whole characters. At the end of the text a
/// partial character is an error.
fn decodable(text: &[u8], start: usize, stop: usize) -> Result<usize, ImageError> {
    match std::str::from_utf8(&text[start..stop]) {
        Ok(decoded) => Ok(decoded.len()),
        Err(wrong) if wrong.error_len().is_none() && stop < text.len() => Ok(wrong.valid_up_to()),
        Err(wrong) => Err(ImageError::Contradiction {
            section: Section::Text.name(),
            index: (start + wrong.valid_up_to()) as u64,
            what: "the text is not valid UTF-8",
        }),
    }
}
