//! One element (or run of character data) and the ways from it to others.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::hash::{Hash, Hasher};

use crate::attribute::{Attribute, Attributes};
use crate::document::{Document, NameMatcher};
use crate::layout::{ELEMENT, NodeRecord, RESOLVED_TEXT, Section, TEXT};
use crate::source::Position;
use crate::value::{self, ValueError};

/// A node of a document: an element, unless its [`is_element`](Node::is_element) says otherwise;
/// the navigation below leads to elements only.
///
/// Nodes compare by their place in the document; nodes of different images are never equal.
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

    /// The local name, without prefix; empty for character data.
    #[inline]
    pub fn name(&self) -> &'a str {
        match self.record() {
            Some(record) if record.kind.get() == ELEMENT => self.document.name(record.name.get()),
            _ => "",
        }
    }

    /// The number of its name within this image, the same for equal names, below 65,535; that
    /// number itself for character data. Lets a consumer look each distinct name up once.
    #[inline]
    pub fn name_number(&self) -> u16 {
        match self.record() {
            Some(record) if record.kind.get() == ELEMENT => record.name.get(),
            _ => u16::MAX,
        }
    }

    /// One past the index of the last node within it: with [`Document::node`], the way to walk
    /// elements and character data in one pass.
    #[inline]
    pub fn subtree_end(&self) -> u32 {
        self.end()
    }

    /// The characters of a run of character data, entities resolved; empty for an element.
    #[inline]
    pub fn character_run(&self) -> &'a str {
        self.record()
            .map_or("", |record| self.document.character_data(record))
    }

    /// Where a run of character data is written in the image's text, entities unresolved; empty for
    /// an element.
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

    /// The namespace prefix as written, empty when there is none.
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

    /// Whether it is an element with this local name.
    #[inline]
    pub fn is(&self, name: &str) -> bool {
        self.record().is_some_and(|record| {
            record.kind.get() == ELEMENT && self.document.is_name(record.name.get(), name)
        })
    }

    /// Whether it is an element and not character data.
    #[inline]
    pub fn is_element(&self) -> bool {
        self.record()
            .is_some_and(|record| record.kind.get() == ELEMENT)
    }

    /// Its place in document order, for [`Document::node`].
    #[inline]
    pub fn index(&self) -> u32 {
        self.index
    }

    /// The document it belongs to.
    #[inline]
    pub fn document(&self) -> Document<'a> {
        self.document
    }

    /// The value of an attribute, entities resolved. Prefixed attributes go by their name as
    /// written (`xsi:type`).
    #[inline]
    pub fn attr(&self, name: &str) -> Option<&'a str> {
        self.attribute(name).map(|attribute| attribute.value())
    }

    /// An attribute by its name as written.
    pub fn attribute(&self, name: &str) -> Option<Attribute<'a>> {
        let mut records = self.document.attribute_records(self.index).iter();
        let matcher = self.document.matcher(name);
        let record = records.find(|record| matcher.is(record.name.get()))?;
        Some(Attribute::new(*self, record))
    }

    /// All attributes in the order in which they are written, `xmlns` declarations included.
    #[inline]
    pub fn attributes(&self) -> Attributes<'a> {
        Attributes::new(*self, self.document.attribute_records(self.index))
    }

    /// The attribute's value as a double, in XML Schema's spelling (`INF`, not `inf`), XML white
    /// space around it ignored. Whether it must be finite is the caller's question.
    ///
    /// # Errors
    /// When the attribute is missing, is no number, or is beyond what a double holds.
    pub fn f64(&self, name: &'a str) -> Result<f64, ValueError<'a>> {
        value::parse_f64(self.required(name)?)
    }

    /// The attribute's value as an integer, in XML Schema's spelling, XML white space around it
    /// ignored.
    ///
    /// # Errors
    /// When the attribute is missing, is no integer, or is beyond 64 bits.
    pub fn i64(&self, name: &'a str) -> Result<i64, ValueError<'a>> {
        value::parse_i64(self.required(name)?)
    }

    fn required(&self, name: &'a str) -> Result<Attribute<'a>, ValueError<'a>> {
        self.attribute(name)
            .ok_or(ValueError::Missing { node: *self, name })
    }

    /// The element it lies in; `None` for the root.
    #[inline]
    pub fn parent(&self) -> Option<Node<'a>> {
        let parent = self.record()?.parent.get();
        // Parents come first; anything else is corrupt and could lead round in circles.
        (parent < self.index)
            .then(|| Node::new(self.document, parent))
            .filter(Node::is_element)
    }

    /// The elements directly within it.
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

    /// The first element of this name directly within it.
    pub fn child(&self, name: &str) -> Option<Node<'a>> {
        self.children_named(name).next()
    }

    /// The elements of this name directly within it.
    pub fn children_named<'s>(&self, name: &'s str) -> ChildrenNamed<'a, 's> {
        ChildrenNamed {
            children: self.children(),
            matcher: self.document.matcher(name),
            known: None,
            other: None,
        }
    }

    /// All elements within it, itself excluded, in document order.
    pub fn descendants(&self) -> Descendants<'a> {
        let children = self.children();
        Descendants {
            document: self.document,
            next: children.next,
            end: children.end,
        }
    }

    /// All elements of this name within it; costs nothing per other element.
    pub fn descendants_named(&self, name: &str) -> DescendantsNamed<'a> {
        self.document.named(name).within(*self)
    }

    /// The next element with the same parent.
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

    /// Its parent, that one's parent, and so on up to the root.
    pub fn ancestors(&self) -> Ancestors<'a> {
        Ancestors {
            next: self.parent(),
        }
    }

    /// The character data directly within it (CDATA included), entities resolved. White space
    /// between child elements is not kept; neither are comments.
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

    /// Offset of its `<` in the image's text.
    #[inline]
    pub fn offset(&self) -> u32 {
        self.record().map_or(0, |record| record.start.get())
    }

    /// One past its last byte in the image's text: past `>` of the end tag.
    pub fn end_offset(&self) -> u32 {
        self.record().map_or(0, |record| record.stop.get())
    }

    /// Where its `<` is.
    pub fn position(&self) -> Position<'a> {
        self.document.position(self.offset())
    }

    #[inline]
    pub(crate) fn record(&self) -> Option<&'a NodeRecord> {
        self.document.node_record(self.index)
    }

    /// One past the last node of its subtree, never at or before the node itself.
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
    /// All of the document: looked up once and not again for every child.
    records: &'a [NodeRecord],
    next: u32,
    end: u32,
}

impl<'a> Children<'a> {
    /// The next child element with its record.
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
    /// The number of the name, once a child has borne it, and the last one of another name:
    /// siblings are mostly alike.
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

/// The elements of one name, which is looked up once for many subtrees; made by
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

    /// Those within an element of the same document, itself excluded, in document order.
    pub fn within(&self, node: Node<'a>) -> DescendantsNamed<'a> {
        let mut postings = self.postings;
        if !postings.is_empty() {
            let Descendants { next, end, .. } = node.descendants();
            let from = postings.partition_point(|index| index.get() < next);
            postings = postings.get(from..).unwrap_or(&[]);
            let upto = postings.partition_point(|index| index.get() < end);
            postings = postings.get(..upto).unwrap_or(&[]);
        }
        DescendantsNamed {
            document: self.document,
            postings: postings.iter(),
        }
    }
}

/// Elements of one name within a subtree; made by [`Node::descendants_named`].
#[derive(Clone, Debug)]
pub struct DescendantsNamed<'a> {
    document: Document<'a>,
    postings: std::slice::Iter<'a, crate::layout::U32>,
}

impl<'a> Iterator for DescendantsNamed<'a> {
    type Item = Node<'a>;

    fn next(&mut self) -> Option<Node<'a>> {
        let document = self.document;
        self.postings
            .by_ref()
            .find_map(|index| document.node(index.get()).filter(Node::is_element))
    }
}

/// The way up to the root; made by [`Node::ancestors`].
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
