//! Converts an element, an attribute or an offset to the locations of a result file.

use qcbus_document::{Attribute, Document, FaultCode, Node, Position};
use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{Location, Locations};

use crate::Subject;

mod expanded;

pub(crate) use expanded::{copied_by, put_there};

/// Target of an issue.
#[derive(Clone, Copy)]
pub enum Place<'p> {
    /// An element, located at its `<`.
    Node(Node<'p>),
    /// An attribute, located at the first character of its name.
    Attribute(Attribute<'p>),
    /// A byte offset in a document's text, for a place without an element.
    Text(Document<'p>, u32),
}

impl<'p> From<Node<'p>> for Place<'p> {
    fn from(node: Node<'p>) -> Place<'p> {
        Place::Node(node)
    }
}

impl<'p> From<Attribute<'p>> for Place<'p> {
    fn from(attribute: Attribute<'p>) -> Place<'p> {
        Place::Attribute(attribute)
    }
}

impl<'p> From<(Document<'p>, u32)> for Place<'p> {
    fn from((document, offset): (Document<'p>, u32)) -> Place<'p> {
        Place::Text(document, offset)
    }
}

impl<'p> Place<'p> {
    /// Returns the attribute of `node` if it exists, else the element that lacks it.
    pub fn attribute_or_node(node: Node<'p>, attribute: &str) -> Place<'p> {
        node.attribute(attribute)
            .map_or(Place::Node(node), Place::Attribute)
    }

    pub(crate) fn document(&self) -> Document<'p> {
        match self {
            Place::Node(node) => node.document(),
            Place::Attribute(attribute) => attribute.node().document(),
            Place::Text(document, _) => *document,
        }
    }

    pub(crate) fn offset(&self) -> u32 {
        match self {
            Place::Node(node) => node.offset(),
            Place::Attribute(attribute) => attribute.offset(),
            Place::Text(_, offset) => *offset,
        }
    }

    fn node(&self) -> Option<Node<'p>> {
        match self {
            Place::Node(node) => Some(*node),
            Place::Attribute(attribute) => Some(attribute.node()),
            Place::Text(..) => None,
        }
    }

    fn xpath(&self, subject: &Subject<'_>) -> Option<String> {
        match self {
            Place::Node(node) => Some(subject.xpath(*node)),
            Place::Attribute(attribute) => Some(format!(
                "{}/@{}",
                subject.xpath(attribute.node()),
                attribute.name()
            )),
            Place::Text(..) => None,
        }
    }

    /// Returns the description of the place for a rule that gives none.
    fn label(&self) -> String {
        match self {
            Place::Node(node) => format!("element `{}`", node.name()),
            Place::Attribute(a) => {
                format!("attribute `{}` of element `{}`", a.name(), a.node().name())
            }
            Place::Text(..) => "here".to_owned(),
        }
    }
}

/// A place with all its data for a result.
pub(crate) struct Spot {
    pub locations: Locations,
    /// Document order: the root's text comes first, then other documents in the order of
    /// references.
    pub order: (usize, u32),
}

/// Computes rows, columns and XPaths. A place in another file is shown at the element of the root
/// file that refers to it.
pub(crate) fn locate(subject: &Subject<'_>, place: &Place<'_>, description: Option<&str>) -> Spot {
    locate_from(subject, place, description, None)
}

/// Locates a place as [`locate`] does, for a place that belongs to another one in the root file. If
/// several references lead to the other file, the one around that place is preferred.
pub(crate) fn locate_from(
    subject: &Subject<'_>,
    place: &Place<'_>,
    description: Option<&str>,
    beside: Option<u32>,
) -> Spot {
    let document = place.document();
    let position = document.position(place.offset());
    let description = description.map_or_else(|| place.label(), str::to_owned);
    let linked = linked_index(subject, &document);
    let order = (linked.map_or(0, |index| index + 1), place.offset());
    if linked.is_none() && position.is_root_file {
        let places = places_of(subject, &position, xpath_there(subject, place));
        return Spot {
            locations: Locations {
                description,
                elsewhere: None,
                places,
            },
            order,
        };
    }
    let path = linked
        .and_then(|index| subject.linked().get(index))
        .map(|linked| linked.path.as_str());
    let path = path
        .filter(|_| position.is_root_file)
        .unwrap_or(position.path);
    let found = linked.and_then(|index| Some((index, subject.linked().get(index)?)));
    let places = match found {
        Some((index, linked)) => {
            let around = beside.and_then(|offset| reference_around(subject, offset, index + 1));
            let reference = around.unwrap_or(linked.referred_at);
            shown_at(subject, reference_at(subject, reference))
        }
        None if subject.is_expanded() => expanded::referring(subject, place),
        None => {
            let around = including_element(place.node()).or(subject.root().root());
            shown_at(subject, around)
        }
    };
    Spot {
        locations: Locations {
            description,
            elsewhere: Some(OtherPlace {
                path: path.to_owned(),
                row: position.row.into(),
                column: position.column.into(),
                xpath: xpath_there(subject, place),
            }),
            places,
        },
        order,
    }
}

fn shown_at(subject: &Subject<'_>, node: Option<Node<'_>>) -> Vec<Location> {
    match node {
        Some(node) => places_of(subject, &node.position(), Some(subject.xpath(node))),
        None => places_of(subject, &subject.written().position(0), None),
    }
}

/// Returns the XPath in the file that contains the place.
fn xpath_there(subject: &Subject<'_>, place: &Place<'_>) -> Option<String> {
    match subject.is_expanded() {
        true => expanded::xpath(subject, place),
        false => place.xpath(subject),
    }
}

fn places_of(
    subject: &Subject<'_>,
    position: &Position<'_>,
    xpath: Option<String>,
) -> Vec<Location> {
    // Results count bytes on disk. In a transcoded file these differ from those of the image.
    let transcoded = subject
        .written()
        .faults()
        .any(|fault| fault.code == FaultCode::EncodingTranscoded);
    let file = Location::File {
        row: u64::from(position.row),
        column: u64::from(position.column),
        offset: (!transcoded).then(|| u64::from(position.offset)),
    };
    std::iter::once(file)
        .chain(xpath.map(|xpath| Location::Xml { xpath }))
        .collect()
}

fn linked_index(subject: &Subject<'_>, document: &Document<'_>) -> Option<usize> {
    let path = document.path();
    if path == subject.root().path() {
        return None;
    }
    subject
        .linked()
        .iter()
        .position(|linked| linked.document.path() == path)
}

/// Returns the reference of the root file around an offset, if it leads to the given document.
fn reference_around(subject: &Subject<'_>, offset: u32, document: usize) -> Option<u32> {
    let before = subject.links().iter().filter(|link| link.at <= offset);
    let nearest = before.max_by_key(|link| link.at)?;
    let node = reference_at(subject, nearest.at)?;
    let is_around = node.offset() == nearest.at && offset < node.end_offset();
    (is_around && leads_to(subject, nearest.to as usize, document)).then_some(nearest.at)
}

/// Checks whether references lead from one document to another. The root counts as the first
/// document.
fn leads_to(subject: &Subject<'_>, from: usize, to: usize) -> bool {
    let mut seen = vec![from];
    let mut next = 0;
    while let Some(&document) = seen.get(next) {
        if document == to {
            return true;
        }
        let linked = document
            .checked_sub(1)
            .and_then(|it| subject.linked().get(it));
        for link in linked.map_or(&[][..], |linked| linked.links) {
            let to = link.to as usize;
            if !seen.contains(&to) {
                seen.push(to);
            }
        }
        next += 1;
    }
    false
}

fn reference_at<'d>(subject: &Subject<'d>, offset: u32) -> Option<Node<'d>> {
    let root = subject.written().root()?;
    // This runs only for issues in other files. Their number is limited, so a full walk is fast
    // enough.
    root.descendants()
        .find(|node| node.offset() == offset)
        .or(Some(root))
}

/// Returns the innermost ancestor of an included element that the root file itself contains.
fn including_element(node: Option<Node<'_>>) -> Option<Node<'_>> {
    node?
        .ancestors()
        .find(|ancestor| ancestor.position().is_root_file)
}
