//! View of a finished image.

use bytemuck::Pod;
use thiserror::Error;

use crate::fault::{Fault, FaultCode};
use crate::layout::{
    ALIGNMENT, FaultRecord, Header, HeapRecord, MAGIC, NAME_IN_HEAP, NameRecord, NodeRecord,
    Section, U16, U32, VERSION,
};
use crate::node::{Elements, Named, Node};

/// A parsed file, read in place.
///
/// It consists of two words, so pass it by value.
#[derive(Clone, Copy)]
pub struct Document<'a> {
    header: &'a Header,
    bytes: &'a [u8],
}

/// Reason why bytes are not a document image.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ImageError {
    /// There are fewer bytes than the image or a header needs.
    #[error("read the document image: it ends after {found} of {needed} bytes")]
    Truncated {
        /// Available bytes.
        found: u64,
        /// Required bytes.
        needed: u64,
    },
    /// The magic number is missing.
    #[error("read the document image: the magic number is missing")]
    NotAnImage,
    /// The image was written by another version of qcbus.
    #[error(
        "read the document image: its layout has version {found}, this program reads version {expected}"
    )]
    Version {
        /// Version in the header.
        found: u32,
        /// Version of this program.
        expected: u32,
    },
    /// A section is outside of the image, is misaligned, or is not a whole number of records.
    #[error("read the document image: the position or size of section {section} is invalid")]
    Section {
        /// Name of the section.
        section: &'static str,
    },
    /// A record contradicts another one.
    #[error("validate the document image: {what} (record {index} of {section})")]
    Contradiction {
        /// The section of the record.
        section: &'static str,
        /// Its index.
        index: u64,
        /// What is wrong.
        what: &'static str,
    },
}

impl<'a> Document<'a> {
    /// Reads the header and checks that every section lies within `bytes`; O(1). The slice may be
    /// longer than the image and may start at any address.
    ///
    /// # Errors
    /// Fails if the bytes are not an image of this version, or end before the image does.
    pub fn open(bytes: &'a [u8]) -> Result<Document<'a>, ImageError> {
        let truncated = |needed: u64| ImageError::Truncated {
            found: bytes.len() as u64,
            needed,
        };
        let head = bytes
            .get(..size_of::<Header>())
            .ok_or(truncated(size_of::<Header>() as u64))?;
        let header: &Header = bytemuck::try_from_bytes(head).map_err(|_| ImageError::NotAnImage)?;
        if header.magic != MAGIC {
            return Err(ImageError::NotAnImage);
        }
        if header.version.get() != VERSION {
            return Err(ImageError::Version {
                found: header.version.get(),
                expected: VERSION,
            });
        }
        let total = header.total.get();
        let image = usize::try_from(total)
            .ok()
            .and_then(|total| bytes.get(..total));
        let document = Document {
            header,
            bytes: image.ok_or(truncated(total))?,
        };
        match Section::ALL
            .iter()
            .find(|&&(section, record)| !document.is_in_place(section, record))
        {
            Some((section, _)) => Err(ImageError::Section {
                section: section.name(),
            }),
            None => Ok(document),
        }
    }

    fn is_in_place(&self, section: Section, record: usize) -> bool {
        let extent = self.header.extents[section as usize];
        let (offset, len) = (extent.offset.get(), extent.len.get());
        let behind_header = offset >= size_of::<Header>() as u64;
        let within = offset
            .checked_add(len)
            .is_some_and(|end| end <= self.bytes.len() as u64);
        let whole = len % record as u64 == 0 && len / record as u64 <= u64::from(u32::MAX);
        behind_header && within && whole && offset % ALIGNMENT as u64 == 0
    }

    /// Returns the root element, or `None` if the file has none.
    #[inline]
    pub fn root(&self) -> Option<Node<'a>> {
        self.node(0).filter(Node::is_element)
    }

    /// Returns the node at `index` in document order, which may be character data.
    #[inline]
    pub fn node(&self, index: u32) -> Option<Node<'a>> {
        self.node_record(index).map(|_| Node::new(*self, index))
    }

    /// Returns the number of nodes: elements and runs of character data.
    #[expect(
        clippy::len_without_is_empty,
        reason = "a document without nodes has no root, so callers ask for the root"
    )]
    pub fn len(&self) -> u32 {
        let bytes = self.header.extents[Section::Nodes as usize].len.get();
        u32::try_from(bytes / size_of::<NodeRecord>() as u64).unwrap_or(0)
    }

    /// Returns the distinct names of the document in the order of their numbers. These are local
    /// names of elements and attribute names as written.
    pub fn names(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let document = *self;
        let records: &'a [NameRecord] = document.records(Section::Names);
        records
            .iter()
            .map(move |record| document.name_of(record).unwrap_or(""))
    }

    /// Returns the elements with this local name in document order; other elements cost nothing.
    pub fn elements(&self, name: &str) -> Elements<'a> {
        Named::new(*self, name).all()
    }

    /// Returns the elements with this local name, for queries in successive subtrees.
    pub fn named(&self, name: &str) -> Named<'a> {
        Named::new(*self, name)
    }

    /// Returns the SHA-256 of the source bytes on disk, as computed by ingest.
    pub fn content_hash(&self) -> [u8; 32] {
        self.header.content_hash
    }

    /// Returns the faults that ingest found, in the order of their discovery.
    pub fn faults(&self) -> impl Iterator<Item = Fault<'a>> + use<'a> {
        let document = *self;
        let records: &'a [FaultRecord] = self.records(Section::Faults);
        records.iter().map(move |record| Fault {
            code: FaultCode::of_record(record).unwrap_or(FaultCode::Syntax),
            offset: record.offset.get(),
            text: document
                .heap_at(record.text_offset.get(), record.text_len.get())
                .unwrap_or(""),
        })
    }

    /// Checks whether the tree is complete: no fault [makes it partial](FaultCode::makes_partial).
    pub fn is_well_formed(&self) -> bool {
        !self.faults().any(|fault| fault.code.makes_partial())
    }

    /// Returns the size of the image in bytes, header included.
    pub fn size(&self) -> usize {
        self.bytes.len()
    }

    /// Returns the bytes of text of all sources together.
    pub fn text_len(&self) -> u32 {
        u32::try_from(self.section(Section::Text).len()).unwrap_or(u32::MAX)
    }
}

/// Access to records. It never panics, for any content of the bytes.
impl<'a> Document<'a> {
    #[inline]
    pub(crate) fn section(&self, section: Section) -> &'a [u8] {
        let extent = &self.header.extents[section as usize];
        let (offset, len) = (extent.offset.get() as usize, extent.len.get() as usize);
        self.bytes
            .get(offset..)
            .and_then(|rest| rest.get(..len))
            .unwrap_or(&[])
    }

    #[inline]
    pub(crate) fn records<T: Pod>(&self, section: Section) -> &'a [T] {
        bytemuck::try_cast_slice(self.section(section)).unwrap_or(&[])
    }

    #[inline]
    pub(crate) fn record<T: Pod>(&self, section: Section, index: usize) -> Option<&'a T> {
        let at = index.checked_mul(size_of::<T>())?;
        let bytes = self.section(section).get(at..)?.get(..size_of::<T>())?;
        bytemuck::try_from_bytes(bytes).ok()
    }

    #[inline]
    pub(crate) fn node_record(&self, index: u32) -> Option<&'a NodeRecord> {
        self.record(Section::Nodes, index as usize)
    }

    #[inline]
    pub(crate) fn text_at(&self, offset: u32, len: u32) -> Option<&'a str> {
        str_at(self.section(Section::Text), offset, len)
    }

    pub(crate) fn heap_at(&self, offset: u32, len: u32) -> Option<&'a str> {
        str_at(self.section(Section::Heap), offset, len)
    }

    /// Returns a resolved value with the position (offset, bytes) of its unresolved text.
    pub(crate) fn heap_value(&self, place: u32) -> Option<(&'a str, u32, u32)> {
        let rest = self.section(Section::Heap).get(place as usize..)?;
        let (head, rest) = rest.split_at_checked(size_of::<HeapRecord>())?;
        let record: &HeapRecord = bytemuck::try_from_bytes(head).ok()?;
        let value = str_at(rest, 0, record.len.get())?;
        Some((value, record.offset.get(), record.raw_len.get()))
    }

    #[inline]
    pub(crate) fn name(&self, id: u16) -> &'a str {
        self.record(Section::Names, usize::from(id))
            .and_then(|record| self.name_of(record))
            .unwrap_or("")
    }

    #[inline]
    pub(crate) fn name_of(&self, record: &NameRecord) -> Option<&'a str> {
        let (offset, len) = (record.offset.get(), record.len.get());
        if len & NAME_IN_HEAP == 0 {
            self.text_at(offset, len)
        } else {
            self.heap_at(offset, len & !NAME_IN_HEAP)
        }
    }

    /// Returns the bytes of a name for comparison, without the cost of UTF-8 validation.
    fn name_bytes(&self, id: u16) -> &'a [u8] {
        let Some(record) = self.record::<NameRecord>(Section::Names, usize::from(id)) else {
            return &[];
        };
        let (offset, len) = (record.offset.get(), record.len.get());
        let section = if len & NAME_IN_HEAP == 0 {
            Section::Text
        } else {
            Section::Heap
        };
        let rest = self.section(section).get(offset as usize..);
        rest.and_then(|rest| rest.get(..(len & !NAME_IN_HEAP) as usize))
            .unwrap_or(&[])
    }

    /// Checks whether the name with this number equals the given name.
    #[inline]
    pub(crate) fn is_name(&self, id: u16, name: &str) -> bool {
        self.record::<NameRecord>(Section::Names, usize::from(id))
            .is_some_and(|record| self.is_record_of(record, name.as_bytes()))
    }

    #[inline]
    fn is_record_of(&self, record: &NameRecord, name: &[u8]) -> bool {
        let len = record.len.get();
        // This length check rules out nearly all other names.
        if (len & !NAME_IN_HEAP) as usize != name.len() {
            return false;
        }
        let section = if len & NAME_IN_HEAP == 0 {
            Section::Text
        } else {
            Section::Heap
        };
        let rest = self.section(section).get(record.offset.get() as usize..);
        rest.and_then(|rest| rest.get(..name.len()))
            .is_some_and(|found| same_bytes(found, name))
    }

    /// Returns a matcher that repeatedly compares name numbers with one name.
    #[inline]
    pub(crate) fn matcher<'s>(&self, name: &'s str) -> NameMatcher<'a, 's> {
        NameMatcher {
            document: *self,
            names: self.section(Section::Names),
            name,
        }
    }

    /// Returns the id of a name by binary search over the sorted ids.
    pub(crate) fn name_id(&self, name: &str) -> Option<u16> {
        let order: &[U16] = self.records(Section::NameOrder);
        let found = order
            .binary_search_by(|id| self.name_bytes(id.get()).cmp(name.as_bytes()))
            .ok()?;
        Some(order[found].get())
    }

    /// Returns the elements of a name, as node indices in document order.
    #[inline]
    pub(crate) fn postings(&self, id: u16) -> &'a [U32] {
        let postings: &'a [U32] = self.records(Section::Postings);
        self.record::<NameRecord>(Section::Names, usize::from(id))
            .and_then(|name| {
                let rest = postings.get(name.first_posting.get() as usize..)?;
                rest.get(..name.postings.get() as usize)
            })
            .unwrap_or(&[])
    }

    pub(crate) fn address(&self) -> *const u8 {
        self.bytes.as_ptr()
    }
}

impl std::fmt::Debug for Document<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Document({:?}, {} nodes)", self.path(), self.len())
    }
}

#[inline]
fn str_at(bytes: &[u8], offset: u32, len: u32) -> Option<&str> {
    let bytes = bytes.get(offset as usize..)?.get(..len as usize)?;
    if bytes.len() <= SHORT && is_ascii(bytes) {
        #[expect(
            unsafe_code,
            reason = "the standard library takes four times as long for short texts"
        )]
        // SAFETY: every byte was just checked to be ASCII, which is valid UTF-8. No earlier check
        // and no result of `validate` is used. As everywhere, a `&[u8]` does not change while it is
        // borrowed; the code that creates it from shared memory must ensure that.
        return Some(unsafe { std::str::from_utf8_unchecked(bytes) });
    }
    std::str::from_utf8(bytes).ok()
}

/// Maximum length in bytes of texts that are checked word by word: names, ids, numbers.
const SHORT: usize = 64;

/// Checks whether all bytes are ASCII; fast for short texts.
#[inline]
fn is_ascii(bytes: &[u8]) -> bool {
    const HIGH: u64 = 0x8080_8080_8080_8080;
    let low = |word: &[u8; 8]| u64::from_le_bytes(*word) & HIGH == 0;
    if let Some(last) = bytes.last_chunk::<8>() {
        return low(last) && bytes.as_chunks::<8>().0.iter().all(low);
    }
    match (bytes.first_chunk::<4>(), bytes.last_chunk::<4>()) {
        (Some(first), Some(last)) => {
            (u32::from_le_bytes(*first) | u32::from_le_bytes(*last)) & (HIGH as u32) == 0
        }
        _ => bytes.iter().all(u8::is_ascii),
    }
}

/// Compares short names faster than a call of `memcmp`.
#[inline]
fn same_bytes(one: &[u8], other: &[u8]) -> bool {
    match (one.first_chunk::<4>(), other.first_chunk::<4>()) {
        (Some(a), Some(b)) => {
            u32::from_le_bytes(*a) == u32::from_le_bytes(*b)
                && (one.len() <= 8 && one.last_chunk::<4>() == other.last_chunk::<4>()
                    || one.len() > 8 && one == other)
        }
        _ => one.iter().eq(other),
    }
}

/// Checks whether numbers stand for one name; see [`Document::matcher`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct NameMatcher<'a, 's> {
    document: Document<'a>,
    names: &'a [u8],
    name: &'s str,
}

impl NameMatcher<'_, '_> {
    #[inline]
    pub(crate) fn is(&self, id: u16) -> bool {
        let at = usize::from(id) * size_of::<NameRecord>();
        let bytes = self.names.get(at..at + size_of::<NameRecord>());
        bytes
            .and_then(|bytes| bytemuck::try_from_bytes(bytes).ok())
            .is_some_and(|record| self.document.is_record_of(record, self.name.as_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_texts_are_validated_like_long_ones() {
        for len in 0..=SHORT + 8 {
            let text = vec![b'a'; len];
            assert_eq!(str_at(&text, 0, len as u32).map(str::len), Some(len));
            for at in 0..len {
                let mut broken = text.clone();
                broken[at] = 0x80;
                assert_eq!(str_at(&broken, 0, len as u32), None, "{len} bytes, {at}");
            }
            for at in 1..len {
                let mut umlaut = text.clone();
                umlaut[at - 1..=at].copy_from_slice("ä".as_bytes());
                let expected = std::str::from_utf8(&umlaut).ok();
                assert!(expected.is_some() && str_at(&umlaut, 0, len as u32) == expected);
            }
        }
    }
}
