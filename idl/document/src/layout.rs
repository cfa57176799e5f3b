//! Memory layout of an image: the only module that knows offsets, record sizes and magic numbers.
//!
//! All integers are little-endian byte arrays with an alignment of one. A checked cast can
//! therefore read a record from any address on any machine. Sections still start on multiples of 64
//! bytes. No record at the start of its column then crosses a cache line needlessly.

use bytemuck::{Pod, Zeroable};

/// First eight bytes of every image.
pub(crate) const MAGIC: [u8; 8] = *b"qcbusDOC";
/// Format version, raised whenever the meaning of a byte changes. Images never outlive a broker, so
/// readers only ever find this version.
pub(crate) const VERSION: u32 = 1;
/// Sections start on multiples of this many bytes.
pub(crate) const ALIGNMENT: usize = 64;
/// Distance between two row and column checkpoints, in bytes of text.
pub(crate) const LINE_STRIDE: usize = 4096;
/// Stands for "no node": the parent of the root.
pub(crate) const NONE: u32 = u32::MAX;
/// Bit in [`NameRecord::len`] that is set when the name lies in the heap instead of the text.
pub(crate) const NAME_IN_HEAP: u32 = 1 << 31;

macro_rules! little_endian {
    ($name:ident, $int:ty, $bytes:literal) => {
        #[doc = concat!("A little-endian `", stringify!($int), "` without alignment.")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Pod, Zeroable)]
        #[repr(transparent)]
        pub(crate) struct $name([u8; $bytes]);

        impl $name {
            #[inline]
            pub(crate) const fn new(value: $int) -> Self {
                Self(value.to_le_bytes())
            }

            #[inline]
            pub(crate) const fn get(self) -> $int {
                <$int>::from_le_bytes(self.0)
            }
        }
    };
}
little_endian!(U16, u16, 2);
little_endian!(U32, u32, 4);
little_endian!(U64, u64, 8);

/// The columns of an image, in their order behind the header.
///
/// The text comes first because its length is known exactly before building, so it never moves. The
/// heap comes last because its length is the hardest to predict.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Section {
    Text,
    Nodes,
    Attributes,
    Names,
    NameOrder,
    Postings,
    Lines,
    Sources,
    Faults,
    Heap,
}

/// Number of sections.
pub(crate) const SECTIONS: usize = 10;

impl Section {
    /// All sections in image order, with the size of their records.
    pub(crate) const ALL: [(Section, usize); SECTIONS] = [
        (Section::Text, 1),
        (Section::Nodes, size_of::<NodeRecord>()),
        (Section::Attributes, size_of::<AttributeRecord>()),
        (Section::Names, size_of::<NameRecord>()),
        (Section::NameOrder, size_of::<U16>()),
        (Section::Postings, size_of::<U32>()),
        (Section::Lines, size_of::<LineRecord>()),
        (Section::Sources, size_of::<SourceRecord>()),
        (Section::Faults, size_of::<FaultRecord>()),
        (Section::Heap, 1),
    ];

    /// Returns the section's name for error messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Section::Text => "text",
            Section::Nodes => "nodes",
            Section::Attributes => "attributes",
            Section::Names => "names",
            Section::NameOrder => "name order",
            Section::Postings => "postings",
            Section::Lines => "lines",
            Section::Sources => "sources",
            Section::Faults => "faults",
            Section::Heap => "heap",
        }
    }
}

/// Position of a section, in bytes from the start of the image.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Extent {
    pub(crate) offset: U64,
    pub(crate) len: U64,
}

/// The first 256 bytes of an image.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Header {
    pub(crate) magic: [u8; 8],
    pub(crate) version: U32,
    /// Always zero. Reserved so that a later version can add flags without moving other fields.
    pub(crate) flags: U32,
    /// Size of the whole image in bytes, including this header.
    pub(crate) total: U64,
    pub(crate) content_hash: [u8; 32],
    pub(crate) extents: [Extent; SECTIONS],
    pub(crate) reserved: [U64; 5],
}

/// An element or a run of character data, in document order; 24 bytes.
///
/// The first child of an element is the next record; its next sibling is the record at `end`.
/// Record `i` owns the attributes from its `first_attribute` up to that of record `i + 1`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct NodeRecord {
    /// Offset of `<`, or of the first character of character data.
    pub(crate) start: U32,
    /// One past the last byte. For resolved character data: the position of its [`HeapRecord`].
    pub(crate) stop: U32,
    pub(crate) parent: U32,
    /// One past the last record of the subtree.
    pub(crate) end: U32,
    pub(crate) first_attribute: U32,
    pub(crate) name: U16,
    pub(crate) kind: U16,
}

/// [`NodeRecord::kind`] of an element.
pub(crate) const ELEMENT: u16 = 0;
/// Character data that equals the text from `start` to `stop`.
pub(crate) const TEXT: u16 = 1;
/// Character data that differs from the text (entities, line ends) and lies in the heap.
pub(crate) const RESOLVED_TEXT: u16 = 2;

/// An attribute; 12 bytes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct AttributeRecord {
    /// Offset of the name.
    pub(crate) offset: U32,
    pub(crate) name: U16,
    /// Distance from the name to the value's first byte; zero when the value lies in the heap.
    pub(crate) value_delta: U16,
    /// Length of the value in bytes; position of the [`HeapRecord`] when it lies in the heap.
    pub(crate) value_len: U32,
}

/// Header in the heap before the bytes of a value that differs from the text.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct HeapRecord {
    /// Offset of the unresolved value in the text.
    pub(crate) offset: U32,
    /// Length of the unresolved value in the text, in bytes.
    pub(crate) raw_len: U32,
    /// Number of value bytes that follow this record.
    pub(crate) len: U32,
}

/// A distinct name: the local name of elements, or the name of attributes as written; 16 bytes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct NameRecord {
    /// Offset of one occurrence in the text (or in the heap).
    pub(crate) offset: U32,
    /// Length in bytes; the top bit is [`NAME_IN_HEAP`].
    pub(crate) len: U32,
    /// Start of the range of postings that lists the elements of this name.
    pub(crate) first_posting: U32,
    pub(crate) postings: U32,
}

/// Counts before a multiple of [`LINE_STRIDE`] within the same source file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LineRecord {
    /// Number of line feeds since the start of the file.
    pub(crate) feeds: U32,
    /// Number of characters since the last line feed.
    pub(crate) characters: U32,
}

/// A file whose bytes are part of the text.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SourceRecord {
    pub(crate) path_offset: U32,
    pub(crate) path_len: U32,
    pub(crate) start: U32,
    pub(crate) len: U32,
}

/// A fault that ingest found.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FaultRecord {
    pub(crate) code: U32,
    pub(crate) offset: U32,
    pub(crate) text_offset: U32,
    pub(crate) text_len: U32,
}

const _: () = assert!(size_of::<Header>() == 256);
const _: () = assert!(size_of::<NodeRecord>() == 24);
const _: () = assert!(size_of::<AttributeRecord>() == 12);
