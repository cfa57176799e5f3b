//! One attribute and its position.

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
    /// Compares identity: attributes are equal if they are the same one, not if they look alike.
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

    /// Returns the name as written, prefix included (`xsi:type`).
    #[inline]
    pub fn name(&self) -> &'a str {
        self.node.document().name(self.record.name.get())
    }

    /// Returns the number of its name within this image, like [`Node::name_number`].
    #[inline]
    pub fn name_number(&self) -> u16 {
        self.record.name.get()
    }

    /// Checks whether its name as written equals the given name.
    #[inline]
    pub fn is(&self, name: &str) -> bool {
        self.node.document().is_name(self.record.name.get(), name)
    }

    /// Returns the value with resolved entities and with white space normalised according to XML.
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

    /// Returns the bytes of the value for a quick check, without the cost of UTF-8 validation.
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

    /// Returns the offset of the name in the image's text.
    pub fn offset(&self) -> u32 {
        self.record.offset.get()
    }

    /// Returns the offset of the value's first byte (after the quote) in the image's text.
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

    /// Returns the bytes of the value as written at [`Attribute::value_offset`], entities
    /// unresolved.
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

    /// Returns the value as a double; see [`Node::f64`].
    ///
    /// # Errors
    /// Fails if it is not a number, or is outside the range of a double.
    pub fn f64(&self) -> Result<f64, ValueError<'a>> {
        value::parse_f64(*self)
    }

    /// Returns the value as an integer; see [`Node::i64`].
    ///
    /// # Errors
    /// Fails if it is not an integer, or does not fit into 64 bits.
    pub fn i64(&self) -> Result<i64, ValueError<'a>> {
        value::parse_i64(*self)
    }

    /// Returns the position of its name.
    pub fn position(&self) -> Position<'a> {
        self.node.document().position(self.offset())
    }

    /// Returns the element that has the attribute.
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

/// The attributes of an element; created by [`Node::attributes`].
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
    /// Returns the attribute records of the node with this index. They end at the first record of
    /// the next node, or at the end of all.
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

    /// Returns the text from `offset` on, as bytes.
    pub(crate) fn text_from(&self, offset: u32) -> Option<&'a [u8]> {
        self.section(Section::Text).get(offset as usize..)
    }
}

/// Returns the first record and the bytes after it.
#[inline]
fn split_record<T: bytemuck::Pod>(bytes: &[u8]) -> Option<(&T, &[u8])> {
    let (head, rest) = bytes.split_at_checked(size_of::<T>())?;
    Some((bytemuck::try_from_bytes(head).ok()?, rest))
}
