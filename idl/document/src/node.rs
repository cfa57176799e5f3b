//! One element (or run of character data) and the navigation from it to others.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::hash::{Hash, Hasher};

use crate::attribute::{Attribute, Attributes, ValueError};
use crate::document::{Document, NameMatcher};
use crate::layout::{ELEMENT, NodeRecord, RESOLVED_TEXT, Section, TEXT};
use crate::position::Position;

/// A node of a document. It is an element unless [`is_element`](Node::is_element) returns `false`;
/// the navigation below leads to elements only.
///
/// Nodes compare by their position in the document. Nodes of different images are never equal.
#[derive(Clone, Copy)]
pub struct Node<'a> {
    document: Document<'a>,
    index: u32,
}

impl<'a> Node<'a> {
    #[inline]
    pub(crate) fn new(document: Document<'a>, index: u32) -> Node<'a> {
        Node { document, index }
    }

    /// Returns the local name, without prefix; empty for character data.
    #[inline]
    pub fn name(&self) -> &'a str {
        match self.record() {
            Some(record) if record.kind.get() == ELEMENT => self.document.name(record.name.get()),
            _ => "",
        }
    }

    /// Returns the number of its name within this image. Equal names have the same number, which is
    /// below 65,535; character data has 65,535. A consumer can thus look each distinct name up
    /// once.
    #[inline]
    pub fn name_number(&self) -> u16 {
        match self.record() {
            Some(record) if record.kind.get() == ELEMENT => record.name.get(),
            _ => u16::MAX,
        }
    }

    /// Returns one past the index of the last node within it. With [`Document::node`], a caller can
    /// walk elements and character data in one pass.
    #[inline]
    pub fn subtree_end(&self) -> u32 {
        self.end()
    }

    /// Returns the characters of a run of character data, entities resolved; empty for an element.
    #[inline]
    pub fn character_run(&self) -> &'a str {
        self.record()
            .map_or("", |record| self.document.character_data(record))
    }

    /// Returns the range of a run of character data in the image's text, entities unresolved; empty
    /// for an element.
    pub fn character_range(&self) -> std::ops::Range<u32> {
        let written = self.record().and_then(|record| {
            let start = record.start.get();
            match record.kind.get() {
                TEXT => Some(start..record.stop.get()),
                ELEMENT => None,
                _ => {
                    let (_, _, raw_len) = self.document.heap_value(record.stop.get())?;
                    Some(start..start.saturating_add(raw_len))
                }
            }
        });
        written.unwrap_or(0..0)
    }

    /// Returns the namespace prefix as written, empty when there is none.
    pub fn prefix(&self) -> &'a str {
        let name = self.name();
        let written = self.record().and_then(|record| {
            let after = self
                .document
                .text_from(record.start.get().checked_add(1)?)?;
            let colon = after
                .iter()
                .take(MAX_PREFIX)
                .position(|&byte| byte == b':')?;
            let prefix = std::str::from_utf8(after.get(..colon)?).ok()?;
            let spelt = after.get(colon + 1..)?.starts_with(name.as_bytes());
            let plain = !prefix.contains(|c: char| c.is_whitespace() || "/>='\"".contains(c));
            (spelt && plain && !name.is_empty()).then_some(prefix)
        });
        written.unwrap_or("")
    }

    /// Checks whether it is an element with this local name.
    #[inline]
    pub fn is(&self, name: &str) -> bool {
        self.record().is_some_and(|record| {
            record.kind.get() == ELEMENT && self.document.is_name(record.name.get(), name)
        })
    }

    /// Checks whether it is an element and not character data.
    #[inline]
    pub fn is_element(&self) -> bool {
        self.record()
            .is_some_and(|record| record.kind.get() == ELEMENT)
    }

    /// Returns its position in document order, for [`Document::node`].
    #[inline]
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Returns the document it belongs to.
    #[inline]
    pub fn document(&self) -> Document<'a> {
        self.document
    }

    /// Returns the value of an attribute, entities resolved. The name of a prefixed attribute
    /// includes its prefix (`xsi:type`).
    #[inline]
    pub fn attr(&self, name: &str) -> Option<&'a str> {
        self.attribute(name).map(|attribute| attribute.value())
    }

    /// Returns an attribute by its name as written.
    pub fn attribute(&self, name: &str) -> Option<Attribute<'a>> {
        let mut records = self.document.attribute_records(self.index).iter();
        let matcher = self.document.matcher(name);
        let record = records.find(|record| matcher.is(record.name.get()))?;
        Some(Attribute::new(*self, record))
    }

    /// Returns all attributes in the order of the text, including `xmlns` declarations.
    #[inline]
    pub fn attributes(&self) -> Attributes<'a> {
        Attributes::new(*self, self.document.attribute_records(self.index))
    }

    /// Returns the attribute's value as a double, spelt as in XML Schema (`INF`, not `inf`). XML
    /// white space around it is ignored. The caller decides whether it must be finite.
    ///
    /// # Errors
    /// The attribute is missing, is not a number, or is outside the range of a double.
    pub fn f64(&self, name: &'a str) -> Result<f64, ValueError<'a>> {
        self.required(name)?.f64()
    }

    /// Returns the attribute's value as an integer. The value must be spelt as in XML Schema. XML
    /// white space around it is ignored.
    ///
    /// # Errors
    /// The attribute is missing, is not an integer, or needs more than 64 bits.
    pub fn i64(&self, name: &'a str) -> Result<i64, ValueError<'a>> {
        self.required(name)?.i64()
    }

    fn required(&self, name: &'a str) -> Result<Attribute<'a>, ValueError<'a>> {
        self.attribute(name)
            .ok_or(ValueError::Missing { node: *self, name })
    }

    /// Returns the element that contains it; `None` for the root.
    #[inline]
    pub fn parent(&self) -> Option<Node<'a>> {
        let parent = self.record()?.parent.get();
        // Parents come first. A different order means a corrupt image and could cause an endless
        // loop.
        (parent < self.index)
            .then(|| Node::new(self.document, parent))
            .filter(Node::is_element)
    }

    /// Returns the child elements.
    #[inline]
    pub fn children(&self) -> Children<'a> {
        let records = self.document.records(Section::Nodes);
        let children = |next, end| Children {
            document: self.document,
            records,
            next,
            end,
        };
        match records.get(self.index as usize) {
            Some(record) if record.kind.get() == ELEMENT => {
                children(self.index + 1, record.end.get())
            }
            _ => children(0, 0),
        }
    }

    /// Returns the first child element of this name.
    pub fn child(&self, name: &str) -> Option<Node<'a>> {
        self.children_named(name).next()
    }

    /// Returns the child elements of this name.
    pub fn children_named<'s>(&self, name: &'s str) -> ChildrenNamed<'a, 's> {
        ChildrenNamed {
            children: self.children(),
            matcher: self.document.matcher(name),
            known: None,
            other: None,
        }
    }

    /// Returns all elements within it, without itself, in document order.
    pub fn descendants(&self) -> Descendants<'a> {
        let children = self.children();
        Descendants {
            document: self.document,
            next: children.next,
            end: children.end,
        }
    }

    /// Returns all elements of this name within it. Elements of other names cost no time.
    pub fn descendants_named(&self, name: &str) -> Elements<'a> {
        self.document.named(name).within(*self)
    }

    /// Returns the next element with the same parent.
    pub fn next_sibling(&self) -> Option<Node<'a>> {
        let parent_end = self.parent()?.end();
        Children {
            document: self.document,
            records: self.document.records(Section::Nodes),
            next: self.end(),
            end: parent_end,
        }
        .next()
    }

    /// Returns its parent, the parent's parent, and so on up to the root.
    pub fn ancestors(&self) -> Ancestors<'a> {
        Ancestors {
            next: self.parent(),
        }
    }

    /// Returns the character data directly within it (including CDATA), entities resolved. White
    /// space between child elements and comments are left out.
    pub fn text(&self) -> Cow<'a, str> {
        let mut all: Cow<'a, str> = Cow::Borrowed("");
        let children = self.children();
        let mut next = children.next;
        while next < children.end {
            let Some(record) = self.document.node_record(next) else {
                break;
            };
            if record.kind.get() != ELEMENT {
                append(&mut all, self.document.character_data(record));
            }
            next = record.end.get().max(next.saturating_add(1));
        }
        all
    }

    /// Returns the offset of its `<` in the image's text.
    #[inline]
    pub fn offset(&self) -> u32 {
        self.record().map_or(0, |record| record.start.get())
    }

    /// Returns the offset one past its last byte in the image's text: past `>` of the end tag.
    pub fn end_offset(&self) -> u32 {
        self.record().map_or(0, |record| record.stop.get())
    }

    /// Returns the position of its `<`.
    pub fn position(&self) -> Position<'a> {
        self.document.position(self.offset())
    }

    #[inline]
    pub(crate) fn record(&self) -> Option<&'a NodeRecord> {
        self.document.node_record(self.index)
    }

    /// Returns one past the last node of its subtree; always greater than the node's index.
    #[inline]
    pub(crate) fn end(&self) -> u32 {
        let end = self.record().map_or(0, |record| record.end.get());
        end.max(self.index.saturating_add(1))
    }
}

/// Longest namespace prefix that [`Node::prefix`] looks for, in bytes.
const MAX_PREFIX: usize = 256;

fn append<'a>(all: &mut Cow<'a, str>, more: &'a str) {
    if all.is_empty() {
        *all = Cow::Borrowed(more);
    } else {
        all.to_mut().push_str(more);
    }
}

impl<'a> Document<'a> {
    pub(crate) fn character_data(&self, record: &NodeRecord) -> &'a str {
        let (start, stop) = (record.start.get(), record.stop.get());
        match record.kind.get() {
            TEXT => stop
                .checked_sub(start)
                .and_then(|len| self.text_at(start, len))
                .unwrap_or(""),
            RESOLVED_TEXT => self.heap_value(stop).map_or("", |(value, _, _)| value),
            _ => "",
        }
    }
}

impl PartialEq for Node<'_> {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Node<'_> {}

impl Hash for Node<'_> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.index.hash(state);
    }
}

impl PartialOrd for Node<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Node<'_> {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |node: &Self| (node.index, node.document.address());
        place(self).cmp(&place(other))
    }
}

impl std::fmt::Debug for Node<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "<{}> #{} at {}",
            self.name(),
            self.index,
            self.position()
        )
    }
}

/// Child elements; made by [`Node::children`].
#[derive(Clone)]
pub struct Children<'a> {
    document: Document<'a>,
    /// All node records of the document, looked up once for all children.
    records: &'a [NodeRecord],
    next: u32,
    end: u32,
}

impl<'a> Children<'a> {
    /// Returns the next child element with its record.
    #[inline]
    fn advance(&mut self) -> Option<(u32, &'a NodeRecord)> {
        while self.next < self.end {
            let index = self.next;
            let record = self.records.get(index as usize)?;
            self.next = record.end.get().max(index.saturating_add(1));
            if record.kind.get() == ELEMENT {
                return Some((index, record));
            }
        }
        None
    }
}

impl std::fmt::Debug for Children<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.clone()).finish()
    }
}

impl<'a> Iterator for Children<'a> {
    type Item = Node<'a>;

    #[inline]
    fn next(&mut self) -> Option<Node<'a>> {
        let (index, _) = self.advance()?;
        Some(Node::new(self.document, index))
    }
}

/// Child elements of one name; made by [`Node::children_named`].
#[derive(Clone, Debug)]
pub struct ChildrenNamed<'a, 's> {
    children: Children<'a>,
    matcher: NameMatcher<'a, 's>,
    /// The number of the name, once a child with this name was found. `other` is the last number of
    /// a different name. Caching both is fast because siblings mostly have the same name.
    known: Option<u16>,
    other: Option<u16>,
}

impl ChildrenNamed<'_, '_> {
    #[inline]
    fn admits(&mut self, number: u16) -> bool {
        if self.known.is_some() {
            return self.known == Some(number);
        }
        if self.other == Some(number) {
            return false;
        }
        let same = self.matcher.is(number);
        let slot = if same {
            &mut self.known
        } else {
            &mut self.other
        };
        *slot = Some(number);
        same
    }
}

impl<'a> Iterator for ChildrenNamed<'a, '_> {
    type Item = Node<'a>;

    fn next(&mut self) -> Option<Node<'a>> {
        while let Some((index, record)) = self.children.advance() {
            if self.admits(record.name.get()) {
                return Some(Node::new(self.children.document, index));
            }
        }
        None
    }
}

/// Elements of a subtree; made by [`Node::descendants`].
#[derive(Clone, Debug)]
pub struct Descendants<'a> {
    document: Document<'a>,
    next: u32,
    end: u32,
}

impl<'a> Iterator for Descendants<'a> {
    type Item = Node<'a>;

    fn next(&mut self) -> Option<Node<'a>> {
        while self.next < self.end {
            let index = self.next;
            let record = self.document.node_record(index)?;
            self.next += 1;
            if record.kind.get() == ELEMENT {
                return Some(Node::new(self.document, index));
            }
        }
        None
    }
}

/// The elements of one name, which is looked up once for many subtrees. Made by
/// [`Document::named`].
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    document: Document<'a>,
    postings: &'a [crate::layout::U32],
}

impl<'a> Named<'a> {
    pub(crate) fn new(document: Document<'a>, name: &str) -> Named<'a> {
        let postings = document
            .name_id(name)
            .map_or(&[][..], |id| document.postings(id));
        Named { document, postings }
    }

    /// Returns all of them in document order.
    pub(crate) fn all(&self) -> Elements<'a> {
        Elements {
            document: self.document,
            postings: self.postings.iter(),
        }
    }

    /// Returns the elements within an element of the same document, in order, without itself.
    pub fn within(&self, node: Node<'a>) -> Elements<'a> {
        let mut postings = self.postings;
        if !postings.is_empty() {
            let Descendants { next, end, .. } = node.descendants();
            let from = postings.partition_point(|index| index.get() < next);
            postings = postings.get(from..).unwrap_or(&[]);
            let upto = postings.partition_point(|index| index.get() < end);
            postings = postings.get(..upto).unwrap_or(&[]);
        }
        let document = self.document;
        Named { document, postings }.all()
    }
}

/// The elements of one name in a document or a subtree, in order; made by [`Document::elements`] and
/// [`Node::descendants_named`].
#[derive(Clone, Debug)]
pub struct Elements<'a> {
    document: Document<'a>,
    postings: std::slice::Iter<'a, crate::layout::U32>,
}

impl<'a> Iterator for Elements<'a> {
    type Item = Node<'a>;

    fn next(&mut self) -> Option<Node<'a>> {
        let document = self.document;
        self.postings
            .by_ref()
            .find_map(|index| document.node(index.get()).filter(Node::is_element))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (0, Some(self.postings.len()))
    }
}

/// The ancestors up to the root; made by [`Node::ancestors`].
#[derive(Clone, Debug)]
pub struct Ancestors<'a> {
    next: Option<Node<'a>>,
}

impl<'a> Iterator for Ancestors<'a> {
    type Item = Node<'a>;

    fn next(&mut self) -> Option<Node<'a>> {
        let node = self.next?;
        self.next = node.parent();
        Some(node)
    }
}
