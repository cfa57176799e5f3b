//! CRG records of roads and junctions (OpenDRIVE 1.9, 10.6, 12.12).

use qcbus_document::Node;
use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Level, Place, Sink};

use crate::families::object_parts::{below, number};

/// The records of roads and junctions; those of objects have attributes of their own.
pub(crate) fn records<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Node<'a>> + use<'a> {
    below(map, "CRG", "surface").filter(|record| parent(*record).is_some())
}

/// The road or junction of a record.
pub(crate) fn parent(record: Node<'_>) -> Option<Node<'_>> {
    let parent = record.parent()?.parent()?;
    (parent.is("road") || parent.is("junction")).then_some(parent)
}

/// The record's purpose; elevation when it names none.
pub(crate) fn purpose(record: Node<'_>) -> &str {
    record.attr("purpose").unwrap_or("elevation")
}

/// Reports attributes that a record of this mode or purpose must not have. One that says what
/// its absence would mean does no harm and is reported as `harmless`. Findings carry `uid`, if it
/// is not the rule's first.
pub(crate) fn must_not_have(
    record: Node<'_>,
    attributes: &[(&str, f64)],
    because: &str,
    uid: Option<&str>,
    harmless: Level,
    found: &mut Sink<'_>,
) {
    for (name, default) in attributes {
        let Some(value) = record.attr(name) else {
            continue;
        };
        let text = format!(
            "the CRG record has `{name}=\"{value}\"`, which must not be used with {because}"
        );
        let mut finding = found.issue(Place::attribute_or_node(record, name), text);
        if let Some(uid) = uid {
            finding = finding.uid(uid);
        }
        if number(record, name) == Some(*default) {
            finding.level(harmless);
        }
    }
}
