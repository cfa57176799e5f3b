//! Maps places in an expanded scenario to its source files.

use qcbus_document::{Attribute, Document, Node};
use qcbus_formats::xqar::{Location, Locations};

use super::{Place, places_of, shown_at};
use crate::Subject;

/// Returns the place of the root file that brought a place of a library into the expanded scenario:
/// the inserted value, else the reference to the group.
pub(super) fn referring(subject: &Subject<'_>, place: &Place<'_>) -> Vec<Location> {
    if let Some(places) = value_given(subject, place) {
        return places;
    }
    let reference = place.node().and_then(|node| reference_to(subject, node));
    shown_at(subject, reference.or(subject.written().root()))
}

/// Returns the element of the root file that brought the group around a node into the expanded
/// scenario.
fn reference_to<'d>(subject: &Subject<'d>, node: Node<'_>) -> Option<Node<'d>> {
    let mut around = std::iter::once(node).chain(node.ancestors());
    // The name of a copied group comes from the reference to it.
    let name = around.find_map(|node| value_in_root(node.attribute("name")?))?;
    innermost(subject.written(), name)
}

/// Returns the reference that copied a place from a library. Returns `None` if the value there
/// comes from the root file itself.
pub(crate) fn copied_by<'d>(subject: &Subject<'d>, place: &Place<'_>) -> Option<Node<'d>> {
    let node = place.node().filter(|_| subject.is_expanded())?;
    if put_there(subject, place).is_some() || node.position().is_root_file {
        return None;
    }
    reference_to(subject, node)
}

/// Returns the place in the root file of the value that an attribute of a library has in the
/// expanded scenario.
pub(crate) fn put_there(subject: &Subject<'_>, place: &Place<'_>) -> Option<Locations> {
    let is_other = subject.is_expanded() && !matches!(place, Place::Attribute(it) if it.is("name"));
    let places = value_given(subject, place).filter(|_| is_other)?;
    Some(Locations {
        description: "the value that is inserted there".to_owned(),
        elsewhere: None,
        places,
    })
}

fn value_given(subject: &Subject<'_>, place: &Place<'_>) -> Option<Vec<Location>> {
    let Place::Attribute(attribute) = place else {
        return None;
    };
    let offset = value_in_root(*attribute)?;
    let node = innermost(subject.written(), offset)?;
    let holds = |attribute: &Attribute<'_>| attribute.value_offset() == offset;
    let attribute = node.attributes().find(holds)?;
    let xpath = format!("{}/@{}", node.xpath(), attribute.name());
    Some(places_of(subject, &attribute.position(), Some(xpath)))
}

/// Returns the XPath of a place in the file that contains it. In the expanded scenario groups have
/// other names and other neighbours.
pub(super) fn xpath(subject: &Subject<'_>, place: &Place<'_>) -> Option<String> {
    let node = place.node()?;
    if node.document().content_hash() != subject.root().content_hash() {
        return place.xpath(subject);
    }
    let position = node.position();
    let document = match position.is_root_file {
        true => subject.written(),
        false => {
            let mut linked = subject.linked().iter();
            linked
                .find(|linked| linked.document.path() == position.path)?
                .document
        }
    };
    let there = innermost(document, position.offset)?;
    let of_attribute = match place {
        Place::Attribute(attribute) => format!("/@{}", attribute.name()),
        _ => String::new(),
    };
    Some(format!("{}{of_attribute}", there.xpath()))
}

/// Returns the offset in the root file of the value of a library's attribute.
fn value_in_root(attribute: Attribute<'_>) -> Option<u32> {
    let document = attribute.node().document();
    let from = attribute.value_offset();
    let is_root = |offset| document.position(offset).is_root_file;
    (is_root(from) && !is_root(attribute.offset())).then_some(from)
}

/// Returns the innermost element around an offset in a document made of one file.
fn innermost(document: Document<'_>, offset: u32) -> Option<Node<'_>> {
    // In such a document the nodes are sorted by offset.
    let (mut low, mut high) = (0, document.len());
    while low < high {
        let middle = low + (high - low) / 2;
        let starts = |node: Node<'_>| match node.is_element() {
            true => node.offset(),
            false => node.character_range().start,
        };
        if document
            .node(middle)
            .is_some_and(|node| starts(node) <= offset)
        {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    let last = document.node(low.checked_sub(1)?)?;
    let around = std::iter::once(last).chain(last.ancestors());
    let mut elements = around.filter(Node::is_element);
    elements.find(|node| offset < node.end_offset())
}
