//! Growth of the sections of an image, each within its capacity.

use bytemuck::Pod;

use super::{BuildError, ImageBuilder, length, narrow};
use crate::layout::{AttributeRecord, HeapRecord, NONE, NodeRecord, Section, U16, U32};

impl ImageBuilder<'_> {
    pub(super) fn push_node(
        &mut self,
        start: u32,
        stop: u32,
        name: u16,
        kind: u16,
    ) -> Result<u32, BuildError> {
        self.check_range(start, 0)?;
        let index = self.nodes();
        let attributes = self.used[Section::Attributes as usize] / size_of::<AttributeRecord>();
        let record = NodeRecord {
            start: U32::new(start),
            stop: U32::new(stop),
            parent: U32::new(self.open.last().copied().unwrap_or(NONE)),
            end: U32::new(index + 1),
            first_attribute: U32::new(narrow(attributes, "attributes")?),
            name: U16::new(name),
            kind: U16::new(kind),
        };
        if index == NONE - 1 {
            return Err(BuildError::TooLarge { what: "nodes" });
        }
        self.append_record(Section::Nodes, &record)?;
        Ok(index)
    }

    /// Appends a value with its position in the text to the heap, and returns its place.
    pub(super) fn push_resolved(
        &mut self,
        offset: u32,
        raw_len: u32,
        value: Option<&str>,
    ) -> Result<u32, BuildError> {
        let len = match value {
            Some(value) => length(value, "a value")?,
            None => raw_len,
        };
        let record = HeapRecord {
            offset: U32::new(offset),
            raw_len: U32::new(raw_len),
            len: U32::new(len),
        };
        self.room(
            Section::Heap,
            size_of::<HeapRecord>().saturating_add(len as usize),
        )?;
        let place = self.append(Section::Heap, bytemuck::bytes_of(&record))?;
        match value {
            Some(value) => self.append(Section::Heap, value.as_bytes())?,
            None => self.append_from_text(offset, raw_len)?,
        };
        Ok(place)
    }

    pub(super) fn append_from_text(&mut self, offset: u32, len: u32) -> Result<u32, BuildError> {
        let at = self.room(Section::Heap, len as usize)?;
        let from = self.places[Section::Text as usize] + offset as usize;
        self.out.copy_within(from..from + len as usize, at);
        self.used[Section::Heap as usize] += len as usize;
        narrow(
            at - self.places[Section::Heap as usize],
            "bytes of the heap",
        )
    }

    /// Returns the id of a name. A new name refers to `written_at` if the text contains it there.
    #[inline]
    pub(super) fn name(&mut self, name: &str, written_at: u32) -> Result<u16, BuildError> {
        if let Some(id) = self.names.find(name) {
            return Ok(id);
        }
        let len = length(name, "a name")?;
        let literal = self.check_range(written_at, len).is_ok()
            && self.text_bytes(written_at, len) == name.as_bytes();
        let (offset, in_heap) = if literal {
            (written_at, false)
        } else {
            (self.append(Section::Heap, name.as_bytes())?, true)
        };
        self.names.add(name, offset, in_heap)
    }

    /// Returns the buffer offset for the next `len` bytes of a section.
    #[inline]
    pub(super) fn room(&self, section: Section, len: usize) -> Result<usize, BuildError> {
        let (used, limit) = (self.used[section as usize], self.limits[section as usize]);
        if len > limit - used {
            let record = Section::ALL[section as usize].1;
            return Err(BuildError::NoRoom {
                what: section.name(),
                capacity: limit / record,
            });
        }
        Ok(self.places[section as usize] + used)
    }

    /// Appends bytes to a section and returns their offset in it.
    #[inline]
    pub(super) fn append(&mut self, section: Section, bytes: &[u8]) -> Result<u32, BuildError> {
        let at = self.room(section, bytes.len())?;
        let offset = narrow(self.used[section as usize], "bytes of a section");
        if section as usize == Section::Text as usize || section as usize == Section::Heap as usize
        {
            narrow(
                self.used[section as usize] + bytes.len(),
                "bytes of a section",
            )?;
        }
        self.out[at..at + bytes.len()].copy_from_slice(bytes);
        self.used[section as usize] += bytes.len();
        // Offsets are only needed for the text and the heap, and their lengths were just checked.
        Ok(offset.unwrap_or(u32::MAX))
    }

    #[inline]
    pub(super) fn append_record<T: Pod>(
        &mut self,
        section: Section,
        record: &T,
    ) -> Result<(), BuildError> {
        self.append(section, bytemuck::bytes_of(record)).map(drop)
    }

    pub(super) fn record_mut<T: Pod>(
        &mut self,
        section: Section,
        index: u32,
    ) -> Result<&mut T, BuildError> {
        let at = self.places[section as usize] + index as usize * size_of::<T>();
        let bytes = self.out.get_mut(at..at + size_of::<T>());
        bytes
            .and_then(|bytes| bytemuck::try_from_bytes_mut(bytes).ok())
            .ok_or(BuildError::Misplaced {
                event: section.name(),
            })
    }

    pub(super) fn text_bytes(&self, offset: u32, len: u32) -> &[u8] {
        let from = self.places[Section::Text as usize] + offset as usize;
        &self.out[from..from + len as usize]
    }

    pub(super) fn text_len(&self) -> u32 {
        u32::try_from(self.used[Section::Text as usize]).unwrap_or(u32::MAX)
    }

    pub(super) fn nodes(&self) -> u32 {
        u32::try_from(self.used[Section::Nodes as usize] / size_of::<NodeRecord>()).unwrap_or(NONE)
    }

    #[inline]
    pub(super) fn check_range(&self, offset: u32, len: u32) -> Result<(), BuildError> {
        let end = u64::from(offset) + u64::from(len);
        if end > self.used[Section::Text as usize] as u64 {
            return Err(BuildError::OutsideText { offset, len });
        }
        Ok(())
    }
}
