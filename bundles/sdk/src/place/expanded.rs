//! From places in an expanded scenario to the files that it was made of.

use qcbus_document::{Attribute, Document, Node};
use qcbus_formats::xqar::Location;

use super::{Place, places_of, shown_at};
use crate::Subject;

/// What of the root file brought a place of a library into the expanded scenario: the value that was
/// put there, else the reference to the group.
pub(super) fn referring(subject: &Subject<'_>, place: &Place<'_>) -> Vec<Location> {
    let value = match place {
        Place::Attribute(attribute) => value_in_root(*attribute),
        _ => None,
    };
    let node = place.node();
    let around = node
        .into_iter()
        .flat_map(|node| std::iter::once(node).chain(node.ancestors()));
    // The name of a copied group is written where it is referred to.
    let mut names = around.filter_map(|node| value_in_root(node.attribute("name")?));
    let Some(offset) = value.or_else(|| names.next()) else {
        return shown_at(subject, subject.written().root());
    };
    let Some(node) = innermost(subject.written(), offset) else {
        return shown_at(subject, subject.written().root());
    };
    let holds = |attribute: &Attribute<'_>| attribute.value_offset() == offset;
    match node.attributes().find(holds) {
        Some(attribute) if value.is_some() => {
            let xpath = format!("{}/@{}", node.xpath(), attribute.name());
            places_of(subject, &attribute.position(), Some(xpath))
        }
        _ => places_of(subject, &node.position(), Some(node.xpath())),
    }
}

/// The XPath of a place in the file that it is written in: in the expanded scenario groups have other
/// names and other neighbours.
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

/// Where the root file has the value of an attribute that a library has.
fn value_in_root(attribute: Attribute<'_>) -> Option<u32> {
    let document = attribute.node().document();
    let from = attribute.value_offset();
    let is_root = |offset| document.position(offset).is_root_file;
    (is_root(from) && !is_root(attribute.offset())).then_some(from)
}

/// The innermost element around an offset of a document of one file.
fn innermost(document: Document<'_>, offset: u32) -> Option<Node<'_>> {
    // In such a document nodes come in the order of their offsets.
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
