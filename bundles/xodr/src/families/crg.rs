//! CRG records of roads and junctions (OpenDRIVE 1.9, 10.6, 12.12).

use crate::families::object_parts::{below, number};
use crate::prelude::*;

/// Returns the CRG records of roads and junctions. Those of objects have other attributes.
pub(crate) fn records<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Node<'a>> + use<'a> {
    below(map, "CRG", "surface").filter(|record| parent(*record).is_some())
}

/// Returns the road or junction of a record.
pub(crate) fn parent(record: Node<'_>) -> Option<Node<'_>> {
    let parent = record.parent()?.parent()?;
    (parent.is("road") || parent.is("junction")).then_some(parent)
}

/// Returns the purpose of the record. The default is elevation.
pub(crate) fn purpose(record: Node<'_>) -> &str {
    record.attr("purpose").unwrap_or("elevation")
}

/// Reports attributes that a record with this mode or purpose must not have. An attribute with its
/// default value is harmless and gets the level `harmless`. Findings have the UID `uid`, or the
/// first UID of the rule.
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
