//! One attribute, its position and its value as a number.

use std::fmt;

use crate::document::Document;
use crate::layout::{AttributeRecord, NodeRecord, Section};
use crate::node::Node;
use crate::position::Position;
use crate::value::{NumberKind, Shown, Wrong, parse_double, parse_integer, trim};

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
        parse_double(trim(self.value())).map_err(|wrong| self.error(wrong, NumberKind::Double))
    }

    /// Returns the value as an integer; see [`Node::i64`].
    ///
    /// # Errors
    /// Fails if it is not an integer, or does not fit into 64 bits.
    pub fn i64(&self) -> Result<i64, ValueError<'a>> {
        parse_integer(trim(self.value())).map_err(|wrong| self.error(wrong, NumberKind::Integer))
    }

    fn error(&self, wrong: Wrong, expected: NumberKind) -> ValueError<'a> {
        let attribute = *self;
        match wrong {
            Wrong::Spelling => ValueError::Malformed {
                attribute,
                expected,
            },
            Wrong::Range => ValueError::OutOfRange {
                attribute,
                expected,
            },
        }
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

impl fmt::Debug for Attribute<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={:?} of {:?}", self.name(), self.value(), self.node)
    }
}

/// Reason why an attribute gives no number. Its text names the element and the attribute;
/// [`node`](ValueError::node) and [`offset`](ValueError::offset) lead to the place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueError<'a> {
    /// The element has no such attribute.
    Missing {
        /// The element.
        node: Node<'a>,
        /// The missing attribute.
        name: &'a str,
    },
    /// The value is not a valid spelling of a number of that kind.
    Malformed {
        /// The attribute.
        attribute: Attribute<'a>,
        /// The expected kind of number.
        expected: NumberKind,
    },
    /// The value is spelt correctly but too large for the type.
    OutOfRange {
        /// The attribute.
        attribute: Attribute<'a>,
        /// The expected kind of number.
        expected: NumberKind,
    },
}

impl<'a> ValueError<'a> {
    /// Returns the element that should have the attribute.
    pub fn node(&self) -> Node<'a> {
        match self {
            ValueError::Missing { node, .. } => *node,
            ValueError::Malformed { attribute, .. } | ValueError::OutOfRange { attribute, .. } => {
                attribute.node()
            }
        }
    }

    /// Returns the name of the requested attribute.
    pub fn attribute_name(&self) -> &'a str {
        match self {
            ValueError::Missing { name, .. } => name,
            ValueError::Malformed { attribute, .. } | ValueError::OutOfRange { attribute, .. } => {
                attribute.name()
            }
        }
    }

    /// Returns the offset to point at: that of the attribute, or of the element that lacks it.
    pub fn offset(&self) -> u32 {
        match self {
            ValueError::Missing { node, .. } => node.offset(),
            ValueError::Malformed { attribute, .. } | ValueError::OutOfRange { attribute, .. } => {
                attribute.offset()
            }
        }
    }
}

impl fmt::Display for ValueError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let element = self.node().name();
        let name = self.attribute_name();
        let (attribute, expected, is_malformed) = match self {
            ValueError::Missing { .. } => {
                return write!(f, "<{element}> has no attribute '{name}'");
            }
            ValueError::Malformed {
                attribute,
                expected,
            } => (attribute, expected, true),
            ValueError::OutOfRange {
                attribute,
                expected,
            } => (attribute, expected, false),
        };
        let value = attribute.value();
        write!(f, "attribute '{name}' of <{element}> is {}, ", Shown(value))?;
        if is_malformed {
            expected.teach_spelling(value, f)
        } else {
            f.write_str(expected.range())
        }
    }
}

impl std::error::Error for ValueError<'_> {}

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

impl fmt::Debug for Attributes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
