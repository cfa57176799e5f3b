//! One attribute and where it stands.

use crate::document::Document;
use crate::layout::{AttributeRecord, Section};
use crate::node::Node;
use crate::source::Position;

/// An attribute of an element.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Attribute<'a> {
    node: Node<'a>,
    index: u32,
}

impl<'a> Attribute<'a> {
    /// The name as written, prefix included (`xsi:type`).
    #[inline]
    pub fn name(&self) -> &'a str {
        self.record()
            .map_or("", |record| self.node.document().name(record.name.get()))
    }

    /// The number of its name within this image, as [`Node::name_number`].
    #[inline]
    pub fn name_number(&self) -> u16 {
        self.record().map_or(u16::MAX, |record| record.name.get())
    }

    /// Whether its name as written is this.
    #[inline]
    pub fn is(&self, name: &str) -> bool {
        let document = self.node.document();
        self.record()
            .is_some_and(|record| document.is_name(record.name.get(), name))
    }

    /// The value, entities resolved and white space normalised as XML demands.
    pub fn value(&self) -> &'a str {
        let document = self.node.document();
        let value = self
            .record()
            .and_then(|record| match record.value_delta.get() {
                0 => document
                    .heap_value(record.value_len.get())
                    .map(|(value, _, _)| value),
                delta => {
                    let offset = record.offset.get().checked_add(u32::from(delta))?;
                    document.text_at(offset, record.value_len.get())
                }
            });
        value.unwrap_or("")
    }

    /// Offset of the name in the image's text.
    pub fn offset(&self) -> u32 {
        self.record().map_or(0, |record| record.offset.get())
    }

    /// Offset of the value's first byte (after the quote) in the image's text.
    pub fn value_offset(&self) -> u32 {
        let offset = self
            .record()
            .and_then(|record| match record.value_delta.get() {
                0 => self
                    .node
                    .document()
                    .heap_value(record.value_len.get())
                    .map(|(_, offset, _)| offset),
                delta => record.offset.get().checked_add(u32::from(delta)),
            });
        offset.unwrap_or(0)
    }

    /// Where its name is.
    pub fn position(&self) -> Position<'a> {
        self.node.document().position(self.offset())
    }

    /// The element that bears it.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    #[inline]
    fn record(&self) -> Option<&'a AttributeRecord> {
        self.node
            .document()
            .record(Section::Attributes, self.index as usize)
    }
}

impl std::fmt::Debug for Attribute<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={:?} of {:?}", self.name(), self.value(), self.node)
    }
}

/// The attributes of an element; made by [`Node::attributes`].
#[derive(Clone, Debug)]
pub struct Attributes<'a> {
    node: Node<'a>,
    next: u32,
    stop: u32,
}

impl<'a> Attributes<'a> {
    #[inline]
    pub(crate) fn new(node: Node<'a>, first: u32, stop: u32) -> Attributes<'a> {
        Attributes {
            node,
            next: first,
            stop: stop.min(node.document().attributes_len()),
        }
    }
}

impl<'a> Iterator for Attributes<'a> {
    type Item = Attribute<'a>;

    #[inline]
    fn next(&mut self) -> Option<Attribute<'a>> {
        (self.next < self.stop).then(|| {
            self.next += 1;
            Attribute {
                node: self.node,
                index: self.next - 1,
            }
        })
    }

    #[inline]
    fn nth(&mut self, n: usize) -> Option<Attribute<'a>> {
        let n = u32::try_from(n).unwrap_or(u32::MAX);
        self.next = self.next.saturating_add(n).min(self.stop);
        self.next()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.stop.saturating_sub(self.next) as usize;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Attributes<'_> {}

impl<'a> Document<'a> {
    /// The records of those attributes that are still to come.
    #[inline]
    pub(crate) fn attribute_records(&self, of: &Attributes<'_>) -> &'a [AttributeRecord] {
        let size = size_of::<AttributeRecord>();
        let range = of.next as usize * size..of.stop as usize * size;
        let bytes = self.section(Section::Attributes).get(range);
        bytes
            .and_then(|bytes| bytemuck::try_cast_slice(bytes).ok())
            .unwrap_or(&[])
    }

    #[inline]
    pub(crate) fn attributes_len(&self) -> u32 {
        let bytes = self.header().extents[Section::Attributes as usize]
            .len
            .get();
        u32::try_from(bytes / size_of::<AttributeRecord>() as u64).unwrap_or(0)
    }

    /// The text from `offset` on, as bytes.
    pub(crate) fn text_from(&self, offset: u32) -> Option<&'a [u8]> {
        self.section(Section::Text).get(offset as usize..)
    }
}
