//! One attribute and where it stands.

use crate::document::Document;
use crate::layout::{AttributeRecord, NodeRecord, Section};
use crate::node::Node;
use crate::source::Position;
use crate::value::{self, ValueError};

/// An attribute of an element.
#[derive(Clone, Copy)]
pub struct Attribute<'a> {
    node: Node<'a>,
    record: &'a AttributeRecord,
}

impl PartialEq for Attribute<'_> {
    /// Attributes are equal when they are the same one, not when they look alike.
    fn eq(&self, other: &Self) -> bool {
        self.node == other.node && std::ptr::eq(self.record, other.record)
    }
}

impl Eq for Attribute<'_> {}

impl<'a> Attribute<'a> {
    #[inline]
    pub(crate) fn new(node: Node<'a>, record: &'a AttributeRecord) -> Attribute<'a> {
        Attribute { node, record }
    }

    /// The name as written, prefix included (`xsi:type`).
    #[inline]
    pub fn name(&self) -> &'a str {
        self.node.document().name(self.record.name.get())
    }

    /// The number of its name within this image, as [`Node::name_number`].
    #[inline]
    pub fn name_number(&self) -> u16 {
        self.record.name.get()
    }

    /// Whether its name as written is this.
    #[inline]
    pub fn is(&self, name: &str) -> bool {
        self.node.document().is_name(self.record.name.get(), name)
    }

    /// The value, entities resolved and white space normalised as XML demands.
    pub fn value(&self) -> &'a str {
        let (document, record) = (self.node.document(), self.record);
        let value = match record.value_delta.get() {
            0 => document
                .heap_value(record.value_len.get())
                .map(|(value, _, _)| value),
            delta => record
                .offset
                .get()
                .checked_add(u32::from(delta))
                .and_then(|offset| document.text_at(offset, record.value_len.get())),
        };
        value.unwrap_or("")
    }

    /// The bytes of the value, without the price of looking whether they are UTF-8: for a first glance.
    #[inline]
    pub fn value_bytes(&self) -> &'a [u8] {
        let record = self.record;
        let delta = record.value_delta.get();
        if delta == 0 {
            return self.value().as_bytes();
        }
        let offset = record.offset.get().checked_add(u32::from(delta));
        let text = offset.and_then(|offset| self.node.document().text_from(offset));
        text.and_then(|text| text.get(..record.value_len.get() as usize))
            .unwrap_or(&[])
    }

    /// Offset of the name in the image's text.
    pub fn offset(&self) -> u32 {
        self.record.offset.get()
    }

    /// Offset of the value's first byte (after the quote) in the image's text.
    pub fn value_offset(&self) -> u32 {
        let record = self.record;
        let offset = match record.value_delta.get() {
            0 => self
                .node
                .document()
                .heap_value(record.value_len.get())
                .map(|(_, offset, _)| offset),
            delta => record.offset.get().checked_add(u32::from(delta)),
        };
        offset.unwrap_or(0)
    }

    /// Bytes of the value as written at [`Attribute::value_offset`], entities unresolved.
    pub fn raw_len(&self) -> u32 {
        let record = self.record;
        match record.value_delta.get() {
            0 => self
                .node
                .document()
                .heap_value(record.value_len.get())
                .map_or(0, |(_, _, raw_len)| raw_len),
            _ => record.value_len.get(),
        }
    }

    /// The value as a double; see [`Node::f64`].
    ///
    /// # Errors
    /// When it is no number, or is beyond what a double holds.
    pub fn f64(&self) -> Result<f64, ValueError<'a>> {
        value::parse_f64(*self)
    }

    /// The value as an integer; see [`Node::i64`].
    ///
    /// # Errors
    /// When it is no integer, or is beyond 64 bits.
    pub fn i64(&self) -> Result<i64, ValueError<'a>> {
        value::parse_i64(*self)
    }

    /// Where its name is.
    pub fn position(&self) -> Position<'a> {
        self.node.document().position(self.offset())
    }

    /// The element that bears it.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }
}

impl std::fmt::Debug for Attribute<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={:?} of {:?}", self.name(), self.value(), self.node)
    }
}

/// The attributes of an element; made by [`Node::attributes`].
#[derive(Clone)]
pub struct Attributes<'a> {
    node: Node<'a>,
    records: std::slice::Iter<'a, AttributeRecord>,
}

impl<'a> Attributes<'a> {
    #[inline]
    pub(crate) fn new(node: Node<'a>, records: &'a [AttributeRecord]) -> Attributes<'a> {
        Attributes {
            node,
            records: records.iter(),
        }
    }
}

impl std::fmt::Debug for Attributes<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.clone()).finish()
    }
}

impl<'a> Iterator for Attributes<'a> {
    type Item = Attribute<'a>;

    #[inline]
    fn next(&mut self) -> Option<Attribute<'a>> {
        let record = self.records.next()?;
        Some(Attribute::new(self.node, record))
    }

    #[inline]
    fn nth(&mut self, n: usize) -> Option<Attribute<'a>> {
        let record = self.records.nth(n)?;
        Some(Attribute::new(self.node, record))
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        self.records.size_hint()
    }
}

impl ExactSizeIterator for Attributes<'_> {}

impl<'a> Document<'a> {
    /// The records of the attributes of the node with this index: from its first one up to that of
    /// the next node, or to the last of all.
    #[inline]
    pub(crate) fn attribute_records(&self, node: u32) -> &'a [AttributeRecord] {
        let size = size_of::<AttributeRecord>();
        let at = node as usize * size_of::<NodeRecord>();
        let nodes = self.section(Section::Nodes).get(at..).unwrap_or(&[]);
        let Some((own, rest)) = split_record::<NodeRecord>(nodes) else {
            return &[];
        };
        let all = self.section(Section::Attributes);
        let first = own.first_attribute.get() as usize * size;
        let stop = split_record::<NodeRecord>(rest).map_or(all.len(), |(next, _)| {
            (next.first_attribute.get() as usize * size).min(all.len())
        });
        all.get(first..stop)
            .and_then(|bytes| bytemuck::try_cast_slice(bytes).ok())
            .unwrap_or(&[])
    }

    /// The text from `offset` on, as bytes.
    pub(crate) fn text_from(&self, offset: u32) -> Option<&'a [u8]> {
        self.section(Section::Text).get(offset as usize..)
    }
}

/// The first record, and the bytes after it.
#[inline]
fn split_record<T: bytemuck::Pod>(bytes: &[u8]) -> Option<(&T, &[u8])> {
    let (head, rest) = bytes.split_at_checked(size_of::<T>())?;
    Some((bytemuck::try_from_bytes(head).ok()?, rest))
}
